// SPDX-License-Identifier: Apache-2.0
#include "driver/memory/whole_grid_cost.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <type_traits>

#include "support/match.h"

namespace dpde::driver {

namespace {

constexpr double number = 8, complex_number = 16;  // bytes
constexpr double small_system = 10000;             // cells up to which the matrix is factorised
constexpr double levels = 4.0 / 3;                 // cells of all grids of a multigrid cycle, relative to the finest
constexpr double cycles = 12, newton_steps = 4;
constexpr double work_of_cycle = 20;  // flops per cell in addition to the operator: smoothing, transfers, sums

double cells_of(const Compiled& compiled) {
  double cells = 1;
  for (const model::Axis& axis : compiled.problem->axes) cells *= axis.cells;
  return cells;
}

double flops_of_transform(double cells) { return 5 * cells * std::log2(std::max(cells, 2.0)); }

/// Complex numbers in a half spectrum of real values: n/2 + 1 along the first axis.
double modes_of(const Compiled& compiled, const std::array<bool, loop::max_rank>& along) {
  double modes = 1;
  bool is_halved = false;
  for (std::size_t a = 0; a < compiled.problem->axes.size(); ++a) {
    const int cells = compiled.problem->axes[a].cells;
    modes *= along[a] && !is_halved ? cells / 2 + 1 : cells;
    is_halved = is_halved || along[a];
  }
  return modes;
}

WholeGridCost cost_of(const Compiled& compiled, const loop::Transform& transform) {
  std::set<std::string> fields;
  for (const loop::Transform::Term& term : transform.terms) fields.insert(term.field);
  const double modes = modes_of(compiled, transform.axes), operands = static_cast<double>(fields.size());
  return {complex_number * modes * (2 + operands), (operands + 1) * flops_of_transform(cells_of(compiled)) +
                                                       8 * modes * static_cast<double>(transform.terms.size())};
}

WholeGridCost cost_of(const Compiled& compiled, const loop::Solve& solve) {
  const double fields = static_cast<double>(solve.unknowns.size()), cells = cells_of(compiled), size = fields * cells;
  double entries = fields;  // of a matrix row
  for (std::size_t a = 0; a < compiled.problem->axes.size(); ++a)
    entries *= solve.reach[a] < 0 ? compiled.problem->axes[a].cells : 2 * solve.reach[a] + 1;
  WholeGridCost once;
  if (compiled.problem->axes.size() == 1) {
    once = {number * size * (entries + 2), 2 * size * entries * fields};
  } else if (solve.coefficients.empty() && solve.is_linear && fields == 1) {
    once = {2 * complex_number * cells, 2 * flops_of_transform(cells)};
  } else if (size <= small_system) {
    const double factors = 8 * size * std::log2(std::max(size, 2.0)) * fields;
    once = {1.5 * number * factors, 4 * factors};
  } else {
    once = {levels * number * size * (entries + 12), levels * cycles * size * (2 * entries + work_of_cycle)};
  }
  if (!solve.is_linear) once.flops *= newton_steps;
  return once;
}

/// Sums costs over all operations of a kind; operations in a repeat count once for each pass.
template <class Kind>
class Costs {
 public:
  explicit Costs(const Compiled& compiled) : compiled_(compiled) {}

  WholeGridCost of(const std::vector<loop::Operation>& operations) const {
    WholeGridCost sum;
    for (const loop::Operation& operation : operations) sum += of(operation);
    return sum;
  }

 private:
  WholeGridCost of(const loop::Operation& operation) const {
    const auto of_kind = [&](const auto& one) {
      if constexpr (std::is_same_v<std::decay_t<decltype(one)>, Kind>) return cost_of(compiled_, one);
      return WholeGridCost{};
    };
    return match(
        operation, [&](const OneOf<loop::Transform, loop::Solve> auto& one) { return of_kind(one); },
        [&](const loop::Repeat& repeat) {
          WholeGridCost pass = of(repeat.body);
          pass.flops *= repeat.count;
          return pass;
        },
        [](const OneOf<loop::Fill, loop::Fold, loop::Reduce, loop::NetworkCall, loop::Sweep> auto&) {
          return WholeGridCost{};
        });
  }

  const Compiled& compiled_;
};

template <class Kind>
WholeGridCost cost_of_all(const Compiled& compiled, const std::string& name) {
  const auto program = std::ranges::find(compiled.loop.programs, name, &loop::Program::name);
  return program == compiled.loop.programs.end() ? WholeGridCost{} : Costs<Kind>(compiled).of(program->body);
}

}  // namespace

WholeGridCost cost_of_transforms(const Compiled& compiled, const std::string& program) {
  return cost_of_all<loop::Transform>(compiled, program);
}

WholeGridCost cost_of_solves(const Compiled& compiled, const std::string& program) {
  return cost_of_all<loop::Solve>(compiled, program);
}

}  // namespace dpde::driver
