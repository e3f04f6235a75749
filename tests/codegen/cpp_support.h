// SPDX-License-Identifier: Apache-2.0
// Runs a stencil program twice, by the reference interpreter and as compiled C++ under the runtime's executor.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "codegen/cpp/compile_cpp.h"
#include "dpde/runtime/executor.h"
#include "dpde/runtime/field.h"
#include "loop/from_stencil.h"
#include "loop/verify_loop.h"
#include "stencil/build.h"
#include "stencil/interpret/interpret.h"

namespace dpde::codegen::testing {

using Values = std::map<std::string, std::vector<double>>;  // interiors by field, "sum NAME" for sums

inline std::vector<double> random_values(std::size_t count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0.25, 1.75);
  std::vector<double> values(count);
  for (double& value : values) value = uniform(random);
  return values;
}

/// The programs of a stencil module, compiled once.
class CompiledCpp {
 public:
  explicit CompiledCpp(stencil::Module source) : source_(std::move(source)) {
    std::vector<std::string> names;
    for (const stencil::Program& program : source_.programs) names.push_back(program.name);
    const loop::Module module = loop::from_stencil(source_, names);
    EXPECT_EQ(loop::verify(module), std::vector<std::string>{});
    CompileResult result = compile_cpp(module);
    EXPECT_EQ(result.error, "");
    compiled_ = result.module;
  }

  const stencil::Module& source() const { return source_; }
  const dpde_program& program(const std::string& name) const { return *compiled_->find(name); }

 private:
  stencil::Module source_;
  std::shared_ptr<CompiledModule> compiled_;
};

struct RunSetup {
  std::string program;
  std::vector<int64_t> cells;
  stencil::Params params;
  int steps = 1;
  int threads = 1;
  Values inputs;  // those not given are random
};

inline std::vector<double> input_values(const RunSetup& setup, const std::string& field, unsigned number) {
  if (setup.inputs.contains(field)) return setup.inputs.at(field);
  std::size_t count = 1;
  for (const int64_t n : setup.cells) count *= static_cast<std::size_t>(n);
  return random_values(count, 17 + number);
}

/// The parameter t counts the steps; dt is 1 there.
inline stencil::Params params_at(const RunSetup& setup, int step) {
  stencil::Params params = setup.params;
  params["t"] = step;
  return params;
}

inline Values run_interpreter(const CompiledCpp& compiled, const RunSetup& setup) {
  const stencil::Module& module = compiled.source();
  const stencil::Program& program = *module.find_program(setup.program);
  stencil::Grid grid{static_cast<int>(setup.cells.size())};
  std::copy(setup.cells.begin(), setup.cells.end(), grid.cells.begin());
  int halo = 1;
  for (const auto& [field, needed] : stencil::required_halo(module, program)) {
    halo = std::max(halo, *std::max_element(needed.begin(), needed.end()));
  }
  stencil::State state(grid, halo);
  const dpde_program& table = compiled.program(setup.program);
  for (int f = 0; f < table.input_count; ++f) state.set(table.fields[f], input_values(setup, table.fields[f], f));

  Values result;
  std::map<std::string, double> sums;
  for (int step = 0; step < setup.steps; ++step)
    sums = stencil::interpret(module, program, state, params_at(setup, step));
  for (const stencil::Swap& swap : program.swaps) result[swap.state] = state.get(swap.state);
  for (const std::string& field : program.keeps) result[field] = state.get(field);
  for (const auto& [name, value] : sums) result["sum " + name] = {value};
  return result;
}

/// All memory starts as NaN, so that a halo nobody filled shows in the result.
inline Values run_compiled(const CompiledCpp& compiled, const RunSetup& setup) {
  const dpde_program& table = compiled.program(setup.program);
  const dpde_layout layout = make_layout(setup.cells, {table.halo[0], table.halo[1], table.halo[2]});
  Executor executor(table, layout, setup.threads);
  std::vector<Field> fields;
  for (int f = 0; f < table.field_count; ++f) {
    fields.emplace_back(layout, f).fill(std::numeric_limits<double>::quiet_NaN());
    if (f < table.input_count) fields.back().copy_in(input_values(setup, table.fields[f], f));
  }
  std::vector<int> place(fields.size());  // which memory holds a field
  for (std::size_t f = 0; f < place.size(); ++f) place[f] = static_cast<int>(f);

  for (int step = 0; step < setup.steps; ++step) {
    for (std::size_t f = 0; f < place.size(); ++f) executor.bind(static_cast<int>(f), fields[place[f]].base());
    const stencil::Params params = params_at(setup, step);
    for (int p = 0; p < table.param_count; ++p) executor.set_param(p, params.at(table.params[p]));
    executor.update_uniforms();
    if (step == 0) executor.prepare();
    executor.run();
    for (int s = 0; s < table.swap_count; ++s) std::swap(place[table.swaps[s].state], place[table.swaps[s].next]);
  }
  Values result;
  const auto add = [&](const std::string& name) {
    std::vector<double> values(static_cast<std::size_t>(cell_count(layout)));
    fields[place[executor.field_index(name)]].copy_out(values);
    result[name] = std::move(values);
  };
  const stencil::Program& program = *compiled.source().find_program(setup.program);
  for (const stencil::Swap& swap : program.swaps) add(swap.state);
  for (const std::string& field : program.keeps) add(field);
  for (int s = 0; s < table.sum_count; ++s) result[std::string("sum ") + table.sums[s]] = {executor.sums()[s]};
  return result;
}

inline void expect_close(const Values& expected, const Values& actual, const std::string& where) {
  ASSERT_FALSE(expected.empty());
  for (const auto& [name, values] : expected) {
    ASSERT_TRUE(actual.contains(name)) << name << " " << where;
    const std::vector<double>& others = actual.at(name);
    ASSERT_EQ(values.size(), others.size());
    double scale = 1;
    for (const double value : values) scale = std::max(scale, std::abs(value));
    for (std::size_t i = 0; i < values.size(); ++i) {
      ASSERT_TRUE(std::isfinite(values[i])) << name << " " << i << " " << where;
      ASSERT_NEAR(values[i], others[i], 2e-13 * scale) << name << " " << i << " " << where;
    }
  }
}

inline void expect_same(const CompiledCpp& compiled, const RunSetup& setup) {
  std::string where = setup.program + " on";
  for (const int64_t n : setup.cells) where += " " + std::to_string(n);
  expect_close(run_interpreter(compiled, setup), run_compiled(compiled, setup), where);
}

}  // namespace dpde::codegen::testing
