// SPDX-License-Identifier: Apache-2.0
#include "random/variants.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "adjoint/reverse/newton_steps.h"
#include "stencil/build.h"
#include "stencil/interpret/with_rounding.h"
#include "stencil/passes/passes.h"
#include "support/split_mix.h"

namespace dpde::testing {

using namespace stencil;

bool is_rounding(double error, const Module& module, const std::string& name, const Grid& grid, std::uint64_t seed) {
  if (error <= 1e-11) return true;
  const RunInputs inputs = inputs_for(module, name, grid, seed);
  const auto run = [&](const Module& m) { return run_interpreted(m, *m.find_program(name), inputs); };
  const Outcome wanted = run(module);
  double rounding = 0;
  for (const double phase : {1.7, 2.3, 3.9, 5.1}) {  // on a few cells one of them may hardly change what is amplified
    const double one = distance(run(with_rounding(module, phase)), wanted);
    if (!std::isfinite(one)) return false;
    rounding = std::max(rounding, one);
  }
  return error <= 10 * rounding;
}

double largest(const Outcome& outcome) {
  double result = 1;
  for (const auto& [field, values] : outcome.fields) {
    for (const double v : values) result = std::max(result, std::abs(v));
  }
  for (const auto& [sum, value] : outcome.sums) result = std::max(result, std::abs(value));
  return result;
}

void add_to(Variants& variants, const Module& module, const std::string& program) {
  for (const Kernel& kernel : module.kernels) {
    if (!variants.module.find_kernel(kernel.name)) variants.module.kernels.push_back(kernel);
  }
  variants.module.programs.push_back(*module.find_program(program));
  variants.programs.push_back(program);
}

RunInputs inputs_for(const Module& module, const std::string& name, const Grid& grid, std::uint64_t seed) {
  SplitMix random(seed);
  const std::size_t size = static_cast<std::size_t>(grid.cells[0]) * grid.cells[1] * grid.cells[2];
  const Program& program = *module.find_program(name);
  const Interface needs = interface_of(module, program);
  RunInputs inputs{grid, {}, {}, 2};
  for (const std::string& field : needs.inputs) {
    if (field != "x" && field != "y" && field != "z") inputs.fields[field] = random.uniform(size, 0.5, 1.5);
  }
  for (const Swap& swap : program.swaps) {
    if (!inputs.fields.contains(swap.state)) inputs.fields[swap.state] = random.uniform(size, 0.5, 1.5);
  }
  for (const std::string& param : needs.params)
    inputs.params[param] = param[0] == 'h' ? random.uniform(0.8, 1.2) : random.uniform(0.2, 0.8);
  return inputs;
}

double distance(const Outcome& got, const Outcome& wanted) {
  double worst = 0;
  const auto add = [&](double a, double b) {
    const double error = std::abs(a - b);
    worst = std::isfinite(error) ? std::max(worst, error) : INFINITY;
  };
  if (got.fields.size() != wanted.fields.size() || got.sums.size() != wanted.sums.size()) return INFINITY;
  for (const auto& [field, values] : wanted.fields) {
    const auto found = got.fields.find(field);
    if (found == got.fields.end() || found->second.size() != values.size()) return INFINITY;
    for (std::size_t i = 0; i < values.size(); ++i) add(found->second[i], values[i]);
  }
  for (const auto& [sum, value] : wanted.sums) {
    if (!got.sums.contains(sum)) return INFINITY;
    add(got.sums.at(sum), value);
  }
  return worst / std::max(largest(got), largest(wanted));
}

Module lowered(Module module, bool with_passes) {
  module = adjoint::with_newton_steps(std::move(module));
  if (!with_passes) return module;
  for (const Pass& pass : default_passes) module = pass.run(module);
  for (const Pass& pass : loop_passes) module = pass.run(module);
  return module;
}

}  // namespace dpde::testing
