// SPDX-License-Identifier: Apache-2.0
#include "driver/jumps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <span>

#include "model/build.h"

namespace dpde::driver {

namespace {

constexpr int stride = 4;
/// Of what is smooth a cell has a quarter of the difference over four, of a jump all of it.
constexpr double share_of_jump = 0.5;
constexpr double least_jump = 1e-2;  // of the largest value: less is told apart from no error by no grid in use

bool may_jump(const model::Expr& formula) {
  return model::any_part(formula, [](const model::Expr& e) {
    if (const model::Call* call = std::get_if<model::Call>(&e->kind))
      return call->fn == Fn::sign || call->fn == Fn::floor;
    return std::holds_alternative<model::Select>(e->kind);
  });
}

/// Whether some cell beside another along the axis differs from it as much as from those four cells on.
bool jumps_along(std::span<const double> values, const std::array<int, 3>& cells, std::size_t axis) {
  std::array<std::size_t, 3> strides{1, static_cast<std::size_t>(cells[0]),
                                     static_cast<std::size_t>(cells[0]) * static_cast<std::size_t>(cells[1])};
  const auto count = static_cast<std::size_t>(cells[axis]), step = strides[axis];
  double next = 0, farther = 0, largest = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t place = i / step % count;
    largest = std::max(largest, std::abs(values[i]));
    if (place + 1 < count) next = std::max(next, std::abs(values[i + step] - values[i]));
    if (place + stride < count) farther = std::max(farther, std::abs(values[i + stride * step] - values[i]));
  }
  return next > least_jump * largest && next > share_of_jump * farther;
}

bool jumps(Session& session, const model::Coefficient& c) {
  if (c.value.formula && !may_jump(*c.value.formula)) return false;
  const std::vector<double> values = session.workspace().dense(c.name);
  std::array<int, 3> cells{1, 1, 1};
  for (std::size_t axis = 0; axis < session.axes().size(); ++axis) cells[axis] = session.axes()[axis].cells;
  const auto count =
      static_cast<std::size_t>(cells[0]) * static_cast<std::size_t>(cells[1]) * static_cast<std::size_t>(cells[2]);
  if (values.size() != count) return c.value.formula.has_value();
  for (std::size_t axis = 0; axis < session.axes().size(); ++axis) {
    if (jumps_along(values, cells, axis)) return true;
  }
  return false;
}

/// A condition of places between two numbers. What states decide moves, and is another matter; of formulas it is not
/// known whether they meet.
bool is_jump(const model::Problem& problem, const model::Expr& e) {
  const model::Select* select = std::get_if<model::Select>(&e->kind);
  if (select == nullptr || select->yes == select->no) return false;
  const bool of_states =
      std::ranges::any_of(problem.states, [&](const model::State& s) { return model::reads(e, s.name); });
  return !of_states && model::is_uniform(select->yes) && model::is_uniform(select->no);
}

/// Calls `found` on what stands in a difference as it is, and not as 1/k in an interpolation.
void for_each_in_flux(const model::Expr& e, const std::function<void(const model::Expr&)>& found) {
  if (const model::Interpolate* mean = std::get_if<model::Interpolate>(&e->kind)) {
    const model::Binary* inverse = std::get_if<model::Binary>(&mean->operand->kind);
    if (inverse != nullptr && inverse->op == BinaryOp::divide) return for_each_in_flux(inverse->left, found);
  }
  found(e);
  model::for_each_part(e, [&](const model::Expr& part) { for_each_in_flux(part, found); });
}

bool holds_derivative(const model::Expr& e, int axis) {
  return model::any_part(e, [&](const model::Expr& part) {
    const model::Derivative* d = std::get_if<model::Derivative>(&part->kind);
    return d != nullptr && d->axis == axis;
  });
}

}  // namespace

std::vector<Jump> jumps_in_fluxes(Session& session) {
  const model::Problem& problem = session.problem();
  std::vector<Jump> result;
  const auto add = [&](const std::string& coefficient, const SourceRange& range) {
    if (std::ranges::find(result, coefficient, &Jump::coefficient) == result.end())
      result.push_back({coefficient, range});
  };
  for (const model::State& state : problem.states) {
    if (!state.rhs) continue;
    model::any_part(*state.rhs, [&](const model::Expr& e) {
      const model::Derivative* d = std::get_if<model::Derivative>(&e->kind);
      if (d == nullptr || !holds_derivative(d->operand, d->axis)) return false;
      const SourceRange range = e->origin.range.is_known() ? e->origin.range : state.origin.range;
      for_each_in_flux(d->operand, [&](const model::Expr& part) {
        const model::Field* field = std::get_if<model::Field>(&part->kind);
        const auto c = field == nullptr
                           ? problem.coefficients.end()
                           : std::ranges::find(problem.coefficients, field->name, &model::Coefficient::name);
        if (c != problem.coefficients.end() && jumps(session, *c)) add(c->name, range);
        if (is_jump(problem, part)) add("", range);
      });
      return false;
    });
  }
  return result;
}

}  // namespace dpde::driver
