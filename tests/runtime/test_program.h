// SPDX-License-Identifier: Apache-2.0
// Builds dpde_program tables by hand: tests of the runtime need no compiler.
//
//   TestProgram p("step", 1, {"u"}, {"u_next"});            inputs, other fields
//   p.sweep(row, {{"u", -1}, {"u", 1}, {"u_next"}});        streams: field and offsets x, y, z
//   Executor executor(p.table(), layout);
#pragma once

#include <array>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "dpde/kernel_abi.h"

namespace dpde::test {

struct StreamOf {
  std::string field;
  int x = 0, y = 0, z = 0;
};

/// a*(u + v)/2 + b*(v - u)/m = c, both sides times 2m.
constexpr dpde_rule mirrored{0, 0, {{}, 1, {}}, {{{{{0, 1}, {0, 1}, {}}, {{2, 0}, {-2, 0}, {}}}, {0, 2}, 0, 1}, 1, {}}};
constexpr dpde_side fixed_value(int value = DPDE_ZERO) { return {&mirrored, {DPDE_ONE, DPDE_ZERO}, value, -1}; }
constexpr dpde_side zero_gradient{&mirrored, {DPDE_ZERO, DPDE_ONE}, DPDE_ZERO, -1};
constexpr dpde_side around{nullptr, {DPDE_ZERO, DPDE_ZERO}, DPDE_ZERO, -1};
constexpr dpde_boundary periodic{around, around};

/// Streams or grids of a row of doubles.
struct Doubles {
  void* const* pointers;
  double* operator[](int k) const { return static_cast<double*>(pointers[k]); }
};

class TestProgram {
 public:
  TestProgram(std::string name, int rank, std::vector<std::string> inputs, std::vector<std::string> others = {})
      : name_(std::move(name)), rank_(rank), input_count_(static_cast<int>(inputs.size())), fields_(std::move(inputs)) {
    fields_.insert(fields_.end(), others.begin(), others.end());
  }
  TestProgram(const TestProgram&) = delete;
  TestProgram& operator=(const TestProgram&) = delete;

  void params(std::vector<std::string> names, void (*compute)(const double*, double*), int uniform_count) {
    params_ = std::move(names);
    compute_ = compute;
    uniform_count_ = uniform_count;
  }
  void sums(std::vector<std::string> names) { sums_ = std::move(names); }
  void halo(std::array<int64_t, 3> halo) { halo_ = halo; }
  /// For derivatives: the primal of `derived`.
  void link(int kind, const std::string& primal, int derived_kind, const std::string& derived) {
    const auto& names = derived_kind == DPDE_LINK_FIELD ? fields_ : derived_kind == DPDE_LINK_PARAM ? params_ : sums_;
    links_.push_back({kind, primals_.emplace_back(primal).c_str(), derived_kind, index(names, derived)});
  }
  /// For adjoints: x_bar belongs to x.
  void bars(const std::vector<std::string>& fields) {
    for (const std::string& field : fields) link(DPDE_LINK_FIELD, field, DPDE_LINK_FIELD, field + "_bar");
  }
  void bar_of_loss() { link(DPDE_LINK_SUM, "loss", DPDE_LINK_PARAM, "loss_bar"); }
  void swap(const std::string& state, const std::string& next) {
    swaps_.push_back({index(fields_, state), index(fields_, next)});
  }

  dpde_fill fill_of(const std::string& field,
                    std::array<dpde_boundary, 3> axes = {periodic, periodic, periodic}) const {
    return {index(fields_, field), {axes[0], axes[1], axes[2]}};
  }
  void prepare(const dpde_fill& fill) { prepare_.push_back(fill); }
  void fill(const dpde_fill& fill) { operations_.push_back({DPDE_FILL, fill, 0, {}, 0, 0, nullptr}); }
  void fold(const dpde_fill& fill, std::array<int64_t, 3> grow) {
    operations_.push_back({DPDE_FOLD, fill, 0, {grow[0], grow[1], grow[2]}, 0, 0, nullptr});
  }
  void reduce(int kind, const std::string& field, const std::string& result, std::array<int32_t, 3> over) {
    dpde_operation operation{};
    operation.kind = DPDE_REDUCE;
    operation.reduce = {kind, index(fields_, field), index(fields_, result), {over[0], over[1], over[2]}};
    operations_.push_back(operation);
  }
  void sweep(dpde_row_fn row, const std::vector<StreamOf>& streams, std::vector<dpde_fill> then = {},
             const std::vector<std::string>& sums = {}, std::array<int64_t, 3> grow = {}, bool serial = false,
             const std::vector<std::string>& grids = {}) {
    std::vector<dpde_stream>& table = streams_.emplace_back();
    for (const StreamOf& stream : streams)
      table.push_back({index(fields_, stream.field), {stream.x, stream.y, stream.z}, 0});
    std::vector<int>& sum_table = indices_.emplace_back();
    for (const std::string& sum : sums) sum_table.push_back(index(sums_, sum));
    std::vector<dpde_grid>& grid_table = grids_.emplace_back();
    for (const std::string& grid : grids) grid_table.push_back({index(fields_, grid), serial ? 1 : 0});
    kernels_.push_back({"kernel", row, static_cast<int>(table.size()), table.data(),
                        static_cast<int>(grid_table.size()), grid_table.data(), static_cast<int>(sum_table.size()),
                        sum_table.data()});
    const std::vector<dpde_fill>& then_table = thens_.emplace_back(std::move(then));
    operations_.push_back({DPDE_SWEEP,
                           {},
                           static_cast<int>(kernels_.size()) - 1,
                           {grow[0], grow[1], grow[2]},
                           serial ? 1 : 0,
                           static_cast<int>(then_table.size()),
                           then_table.data()});
  }

  struct Carry {
    std::string state, next, result;
  };
  struct Stacked {
    std::string field;
    int stack;
  };
  /// Turns the last `size` operations into the block of a repeat.
  void repeat(std::int64_t count, std::size_t size, const std::vector<Carry>& carries,
              const std::vector<Stacked>& saves = {}, const std::vector<Stacked>& loads = {}) {
    const auto begin = operations_.end() - static_cast<std::ptrdiff_t>(size);
    const std::vector<dpde_operation>& block = blocks_.emplace_back(begin, operations_.end());
    operations_.erase(begin, operations_.end());
    std::vector<dpde_carry>& carried = carries_.emplace_back();
    for (const Carry& c : carries)
      carried.push_back({index(fields_, c.state), index(fields_, c.next), index(fields_, c.result)});
    const auto list = [&](const std::vector<Stacked>& all) {
      std::vector<dpde_stacked>& stacked = stacked_.emplace_back();
      for (const Stacked& each : all) stacked.push_back({index(fields_, each.field), each.stack});
      return stacked.data();
    };
    const auto length = [](const auto& all) { return static_cast<int>(all.size()); };
    dpde_operation operation{};
    operation.kind = DPDE_REPEAT;
    operation.repeat = {count,         length(block), block.data(),  length(carried), carried.data(),
                        length(saves), list(saves),   length(loads), list(loads)};
    operations_.push_back(operation);
  }
  /// Number of fields for which each stack needs memory.
  void stacks(std::vector<std::int64_t> fields) { stack_fields_ = std::move(fields); }

  const dpde_program& table() {
    for (const auto& [names, pointers] :
         {std::pair{&fields_, &field_names_}, {&params_, &param_names_}, {&sums_, &sum_names_}}) {
      pointers->clear();
      for (const std::string& name : *names) pointers->push_back(name.c_str());
    }
    table_ = {};
    table_.version = DPDE_ABI_VERSION;
    table_.name = name_.c_str();
    table_.rank = rank_;
    for (size_t a = 0; a < 3; ++a) table_.halo[a] = halo_[a];
    table_.field_count = static_cast<int>(fields_.size());
    table_.input_count = input_count_;
    table_.fields = field_names_.data();
    table_.param_count = static_cast<int>(params_.size());
    table_.params = param_names_.data();
    table_.uniform_count = uniform_count_;
    table_.compute_uniforms = compute_;
    table_.sum_count = static_cast<int>(sums_.size());
    table_.sums = sum_names_.data();
    table_.kernel_count = static_cast<int>(kernels_.size());
    table_.kernels = kernels_.data();
    table_.prepare_count = static_cast<int>(prepare_.size());
    table_.prepare = prepare_.data();
    table_.operation_count = static_cast<int>(operations_.size());
    table_.operations = operations_.data();
    table_.stack_count = static_cast<int>(stack_fields_.size());
    table_.stacks = stack_fields_.data();
    table_.swap_count = static_cast<int>(swaps_.size());
    table_.swaps = swaps_.data();
    table_.link_count = static_cast<int>(links_.size());
    table_.links = links_.data();
    return table_;
  }

 private:
  static int index(const std::vector<std::string>& names, const std::string& name) {
    for (size_t i = 0; i < names.size(); ++i) {
      if (names[i] == name) return static_cast<int>(i);
    }
    throw std::string("no such name: " + name);
  }

  std::string name_;
  int rank_, input_count_, uniform_count_ = 0;
  void (*compute_)(const double*, double*) = nullptr;
  std::array<int64_t, 3> halo_{};
  std::vector<std::string> fields_, params_, sums_;
  std::vector<const char*> field_names_, param_names_, sum_names_;
  std::deque<std::vector<dpde_stream>> streams_;
  std::deque<std::vector<int>> indices_;
  std::deque<std::vector<dpde_grid>> grids_;
  std::deque<std::vector<dpde_fill>> thens_;
  std::vector<dpde_kernel> kernels_;
  std::vector<dpde_fill> prepare_;
  std::vector<dpde_operation> operations_;
  std::deque<std::vector<dpde_operation>> blocks_;
  std::deque<std::vector<dpde_carry>> carries_;
  std::deque<std::vector<dpde_stacked>> stacked_;
  std::vector<std::int64_t> stack_fields_;
  std::vector<dpde_swap> swaps_;
  std::deque<std::string> primals_;
  std::vector<dpde_link> links_;
  dpde_program table_{};
};

}  // namespace dpde::test
