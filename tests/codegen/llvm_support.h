// SPDX-License-Identifier: Apache-2.0
// Loop modules written by hand, memory for them, and their meaning spelled out cell by cell (llvm_reference.h).
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "codegen/llvm/jit.h"
#include "dpde/kernel_abi.h"
#include "loop/expressions.h"
#include "loop/loop.h"

namespace dpde::codegen::testing {

using loop::Expr;
using loop::Offset;

inline Expr op(BinaryOp kind, Expr a, Expr b) { return loop::make(loop::Binary{kind, a, b}); }
inline Expr operator+(Expr a, Expr b) { return op(BinaryOp::add, a, b); }
inline Expr operator-(Expr a, Expr b) { return op(BinaryOp::subtract, a, b); }
inline Expr operator*(Expr a, Expr b) { return op(BinaryOp::multiply, a, b); }
inline Expr call(Fn fn, std::vector<Expr> arguments) { return loop::make(loop::Call{fn, std::move(arguments)}); }
inline Expr select(Expr condition, Expr yes, Expr no) { return loop::make(loop::Select{condition, yes, no}); }
inline Expr inside(Offset offset, int grow) { return loop::make(loop::Inside{offset, grow}); }

/// One row at a time; finish() adds the program "all" that runs every row.
class ModuleBuilder {
 public:
  explicit ModuleBuilder(std::vector<Topology> axes) : axes_(std::move(axes)) { start("k"); }
  void start(const std::string& name) {
    loop::Row row;
    row.name = name;
    row.rank = static_cast<int>(axes_.size());
    row.axes = axes_;
    module_.rows.push_back(row);
  }
  Expr load(const std::string& field, Offset offset = {}) {
    return loop::make(loop::Load{stream(field, offset, loop::Stream::Mode::in)});
  }
  Expr uniform(const std::string& name, Expr value) {
    module_.uniforms.push_back({name, value});
    return loop::make(loop::Uniform{static_cast<int>(module_.uniforms.size()) - 1});
  }
  Expr param(const std::string& name) {
    const auto found = std::find(module_.params.begin(), module_.params.end(), name);
    const int index = static_cast<int>(found - module_.params.begin());
    if (found == module_.params.end()) module_.params.push_back(name);
    return loop::make(loop::Param{index});
  }
  Expr let(const std::string& name, Expr value) {
    row().lets.push_back({name, value});
    return loop::make(loop::Local{static_cast<int>(row().lets.size()) - 1});
  }
  void store(const std::string& field, Expr value) {
    row().stores.push_back({stream(field, {}, loop::Stream::Mode::out), false, value, {}});
  }
  void add(const std::string& field, Expr value) {
    const int index = stream(field, {}, loop::Stream::Mode::inout);
    row().streams[index].mode = loop::Stream::Mode::inout;
    row().stores.push_back({index, true, value, {}});
  }
  void sum(const std::string& name, Expr value) { row().sums.push_back({name, value}); }
  loop::Interp place(const std::string& field, std::vector<Expr> displacement, Offset offset = {},
                     std::array<InterpolationBasis, loop::max_rank> along = {}) {
    std::vector<std::string>& grids = row().grids;
    const auto found = std::find(grids.begin(), grids.end(), field);
    const int index = static_cast<int>(found - grids.begin());
    if (found == grids.end()) grids.push_back(field);
    return {index, offset, std::move(displacement), along};
  }
  void scatter(loop::Interp target, Expr value) { row().scatters.push_back({std::move(target), value}); }

  loop::Module finish() {
    loop::Program program;
    program.name = "all";
    program.axes = axes_;
    const auto note = [](std::vector<std::string>& list, const std::string& name) {
      if (std::find(list.begin(), list.end(), name) == list.end()) list.push_back(name);
    };
    for (const loop::Row& r : module_.rows) {
      for (const loop::Stream& s : r.streams) note(program.fields, s.field);
      for (const std::string& g : r.grids) note(program.fields, g);
      for (const loop::Sum& s : r.sums) note(program.sums, s.name);
      program.body.push_back(loop::Sweep{r.name, 0, !r.scatters.empty(), {}});
    }
    program.input_count = static_cast<int>(program.fields.size());
    module_.programs.push_back(program);
    return module_;
  }

 private:
  loop::Row& row() { return module_.rows.back(); }
  int stream(const std::string& field, Offset offset, loop::Stream::Mode mode) {
    std::vector<loop::Stream>& streams = row().streams;
    for (std::size_t i = 0; i < streams.size(); ++i) {
      if (streams[i].field == field && streams[i].offset == offset) return static_cast<int>(i);
    }
    streams.push_back({field, offset, mode});
    return static_cast<int>(streams.size()) - 1;
  }

  std::vector<Topology> axes_;
  loop::Module module_;
};

/// Fields of one layout with a wide halo, all cells of it random.
class Memory {
 public:
  Memory(const loop::Module& module, std::array<int, 3> cells, int halo = 4) {
    const int rank = module.rows.at(0).rank;
    layout_.rank = rank;
    layout_.size = 1;
    for (int a = 0; a < 3; ++a) {
      layout_.cells[a] = layout_.global[a] = a < rank ? cells[a] : 1;
      layout_.halo[a] = a < rank ? halo : 0;
      layout_.stride[a] = layout_.size;
      layout_.origin += layout_.halo[a] * layout_.stride[a];
      layout_.size *= layout_.cells[a] + 2 * layout_.halo[a];
    }
    std::mt19937 random(7);
    std::uniform_real_distribution<double> draw(0.5, 1.5);
    for (const std::string& field : module.programs.at(0).fields) {
      std::vector<double>& values = fields_[field];
      for (int64_t i = 0; i < layout_.size; ++i) values.push_back(draw(random));
    }
    sums_.assign(module.programs.at(0).sums.size(), 0.0);
  }
  const dpde_layout& layout() const { return layout_; }
  double& at(const std::string& field, int64_t x, int64_t y, int64_t z) {
    return fields_.at(field).at(layout_.origin + x + y * layout_.stride[1] + z * layout_.stride[2]);
  }
  double* base(const std::string& field) { return fields_.at(field).data() + layout_.origin; }
  std::vector<double>& field(const std::string& name) { return fields_.at(name); }
  const std::map<std::string, std::vector<double>>& fields() const { return fields_; }
  std::vector<double>& sums() { return sums_; }

  /// Calls f(y, z, first, count) for the rows of the interior grown on bounded axes.
  template <class F>
  void for_each_row(const std::vector<Topology>& axes, int grow, const F& f) const {
    std::array<int64_t, 3> low{}, high{layout_.cells[0], layout_.cells[1], layout_.cells[2]};
    for (std::size_t a = 0; a < axes.size(); ++a) {
      if (axes[a] == Topology::periodic) continue;
      low[a] -= grow;
      high[a] += grow;
    }
    for (int64_t z = low[2]; z < high[2]; ++z) {
      for (int64_t y = low[1]; y < high[1]; ++y) f(y, z, low[0], high[0] - low[0]);
    }
  }

 private:
  dpde_layout layout_{};
  std::map<std::string, std::vector<double>> fields_;
  std::vector<double> sums_;
};

using Params = std::map<std::string, double>;

inline std::vector<double> values_of(const loop::Module& module, const Params& params) {
  std::vector<double> values;
  for (const std::string& name : module.params) values.push_back(params.at(name));
  return values;
}

/// Calls the compiled rows of the program one after the other over the whole region.
inline void run(const dpde_program& program, const std::vector<Topology>& axes, Memory& memory,
                const std::vector<double>& params, int grow = 0) {
  std::vector<double> uniforms(program.uniform_count + 1);
  program.compute_uniforms(params.data(), uniforms.data());
  for (int k = 0; k < program.kernel_count; ++k) {
    const dpde_kernel& kernel = program.kernels[k];
    std::vector<double> sums(kernel.sum_count, 0.0);
    std::vector<void*> grids;
    for (int g = 0; g < kernel.grid_count; ++g) grids.push_back(memory.base(program.fields[kernel.grids[g].field]));
    memory.for_each_row(axes, grow, [&](int64_t y, int64_t z, int64_t first, int64_t count) {
      std::vector<void*> streams;
      for (int s = 0; s < kernel.stream_count; ++s) {
        const dpde_stream& stream = kernel.streams[s];
        streams.push_back(memory.base(program.fields[stream.field]) + first + stream.offset[0] +
                          (y + stream.offset[1]) * memory.layout().stride[1] +
                          (z + stream.offset[2]) * memory.layout().stride[2]);
      }
      const dpde_row row{streams.data(),
                         grids.data(),
                         uniforms.data(),
                         sums.data(),
                         count,
                         first,
                         y,
                         z,
                         &memory.layout(),
                         uniforms.data() + kernel.own};
      kernel.row(&row);
    });
    for (int s = 0; s < kernel.sum_count; ++s) memory.sums().at(kernel.sums[s]) += sums[s];
  }
}

inline std::shared_ptr<CompiledModule> compile(const loop::Module& module, const JitOptions& options = {}) {
  JitResult result = jit(module, options);
  EXPECT_EQ(result.error, "");
  return result.module;
}

}  // namespace dpde::codegen::testing
