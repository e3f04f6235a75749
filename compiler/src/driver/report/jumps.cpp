// SPDX-License-Identifier: Apache-2.0
#include "driver/report/jumps.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <span>

#include "model/analyse/formula.h"
#include "model/analyse/switches.h"
#include "model/build.h"
#include "model/uses.h"

namespace dpde::driver {

namespace {

constexpr int stride = 4;
/// Difference to the next cell over that to the fourth cell: 1/4 for a smooth function, 1 for a jump.
constexpr double share_of_jump = 0.5;
constexpr double least_jump = 1e-2;  // of the largest value; smaller jumps in data may be measurement noise

/// Whether the largest difference of adjacent cells along the axis is comparable with that over four cells.
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

/// Formulas are analysed independent of the grid; data are checked by their values.
bool jumps(Session& session, const model::Coefficient& c, const model::Movement& everywhere) {
  if (c.value.formula) return model::jump_in(*c.value.formula, session.problem(), everywhere).has_value();
  const std::vector<double> values = session.workspace().dense(c.name);
  std::array<int, 3> cells{1, 1, 1};
  for (std::size_t axis = 0; axis < session.axes().size(); ++axis) cells[axis] = session.axes()[axis].cells;
  const auto count =
      static_cast<std::size_t>(cells[0]) * static_cast<std::size_t>(cells[1]) * static_cast<std::size_t>(cells[2]);
  if (values.size() != count) return false;
  for (std::size_t axis = 0; axis < session.axes().size(); ++axis) {
    if (jumps_along(values, cells, axis)) return true;
  }
  return false;
}

/// The expression without the 1/k in interpolations, i.e. without harmonic means.
model::Expr without_harmonic_means(const model::Expr& e) {
  if (const model::Interpolate* mean = as<model::Interpolate>(e)) {
    const model::Binary* inverse = as<model::Binary>(mean->operand);
    if (inverse != nullptr && inverse->op == BinaryOp::divide) return without_harmonic_means(inverse->left);
  }
  return map_children(e, without_harmonic_means);
}

/// Calls `f` with k for each interpolate(1/k) in `e`.
void for_each_harmonic_mean(const model::Expr& e, const std::function<void(const model::Expr&)>& f) {
  const model::Interpolate* mean = as<model::Interpolate>(e);
  const model::Binary* inverse = mean == nullptr ? nullptr : as<model::Binary>(mean->operand);
  if (inverse != nullptr && inverse->op == BinaryOp::divide) f(inverse->right);
  for_each_child(e, [&](const model::Expr& part) { for_each_harmonic_mean(part, f); });
}

/// Replaces parameters by their values and coefficients by their formulas.
model::Expr with_numbers(const model::Expr& e, const model::Problem& problem) {
  const model::Param* param = as<model::Param>(e);
  const model::Parameter* found = param == nullptr ? nullptr : problem.find_param(param->name);
  if (found != nullptr) return model::number(found->value, e->origin);
  const model::Field* field = as<model::Field>(e);
  const model::Coefficient* c = field == nullptr ? nullptr : problem.find_coefficient(field->name);
  if (c != nullptr && c->value.formula) return with_numbers(*c->value.formula, problem);
  return map_children(e, [&](const model::Expr& part) { return with_numbers(part, problem); });
}

/// Position of a jump of a function in an interval; nullopt if it is continuous. Bisects into the half with the larger
/// change: for a smooth function the change halves each time, for a jump it stays.
std::optional<double> jump_between(const std::function<double(double)>& value, double low, double high) {
  constexpr int halvings = 30;
  constexpr double least = 1e-7, left_of_jump = 0.3;
  double at_low = value(low), at_high = value(high);
  const double change = std::abs(at_high - at_low);
  if (!(change > least * std::max(std::abs(at_low), std::abs(at_high)))) return std::nullopt;
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (low + high), at_middle = value(middle);
    const bool goes_low = std::abs(at_middle - at_low) > std::abs(at_high - at_middle);
    (goes_low ? high : low) = middle;
    (goes_low ? at_high : at_low) = at_middle;
    if (std::abs(at_high - at_low) < left_of_jump * change) return std::nullopt;
  }
  return high;
}

/// Position where a formula of coordinates jumps inside a cell, sampled along lines of centres. "" if there is none, or
/// if the formula is not one of coordinates.
std::string jump_inside_a_cell(const Session& session, const model::Expr& e) {
  constexpr double beside = 1e-9;  // distance from a face, in cell widths
  constexpr int most_lines = 64;   // sampled along an axis
  const model::Expr formula = with_numbers(e, session.problem());
  if (!model::is_formula(formula)) return "";
  const std::vector<model::Axis>& axes = session.axes();
  std::string found;
  const auto look_along = [&](std::size_t along, std::array<double, 3> place) {
    const model::Axis& axis = axes[along];
    const auto value = [&](double at) {
      place[along] = at;
      return model::value_at(formula, place);
    };
    for (int i = 0; i < axis.cells && found.empty(); ++i) {
      const double low = axis.face(i), high = axis.face(i + 1), margin = beside * (high - low);
      const std::optional<double> jump = jump_between(value, low + margin, high - margin);
      if (jump) found = fmt::format("at {} = {:.6g}, between the faces {:.6g} and {:.6g}", axis.name, *jump, low, high);
    }
  };
  for (std::size_t along = 0; along < axes.size(); ++along) {
    std::array<int, 3> count{1, 1, 1}, every{1, 1, 1};
    for (std::size_t a = 0; a < axes.size(); ++a) {
      if (a == along) continue;
      every[a] = (axes[a].cells + most_lines - 1) / most_lines;
      count[a] = (axes[a].cells + every[a] - 1) / every[a];
    }
    for (int i = 0; i < count[0] * count[1] * count[2] && found.empty(); ++i) {
      const std::array<int, 3> cell{i % count[0], i / count[0] % count[1], i / count[0] / count[1]};
      std::array<double, 3> place{};
      for (std::size_t a = 0; a < axes.size(); ++a) place[a] = axes[a].centre(std::int64_t{cell[a]} * every[a]);
      look_along(along, place);
    }
  }
  return found;
}

bool holds_derivative(const model::Expr& e, int axis) {
  return any_part(e, [&](const model::Expr& part) {
    const model::Derivative* d = as<model::Derivative>(part);
    return d != nullptr && d->axis == axis;
  });
}

/// Whether grad(u)/interpolate(1/k) can replace k*grad(u). In (1 + 9*w)*grad(u) that is no use for w.
bool is_factor_in(const model::Expr& flux, const std::string& name) {
  if (const model::Field* field = as<model::Field>(flux)) return field->name == name;
  if (const model::Neg* neg = as<model::Neg>(flux)) return is_factor_in(neg->operand, name);
  const model::Binary* b = as<model::Binary>(flux);
  if (b == nullptr || (b->op != BinaryOp::multiply && b->op != BinaryOp::divide)) return false;
  return is_factor_in(b->left, name) || (b->op == BinaryOp::multiply && is_factor_in(b->right, name));
}

/// Whether the formula is hand-written. Generated projections have masks that block flow; those are not coefficients.
bool is_written(model::UseKind kind) {
  return kind == model::UseKind::equation || kind == model::UseKind::held_value || kind == model::UseKind::event;
}

}  // namespace

std::vector<Jump> jumps_in_fluxes(Session& session) {
  const model::Problem& problem = session.problem();
  const auto is_field = [&](const std::string& name) {
    return problem.find_state(name) != nullptr || problem.find_coefficient(name) != nullptr;
  };
  const model::Movement everywhere{is_field, true};
  std::vector<Jump> result;
  const auto add = [&](const Jump& jump) {
    if (std::ranges::find(result, jump.name, &Jump::name) == result.end()) result.push_back(jump);
  };
  const auto look_at_flux = [&](const model::Expr& flux, const SourceRange& range) {
    any_part(flux, [&](const model::Expr& part) {
      const model::Field* field = as<model::Field>(part);
      const model::Coefficient* c = field == nullptr ? nullptr : problem.find_coefficient(field->name);
      if (c != nullptr && jumps(session, *c, everywhere))
        add({c->name, !c->is_mask && is_factor_in(flux, c->name), range});
      return false;
    });
    const std::optional<model::Jump> jump = model::jump_in(flux, problem, everywhere);
    if (!jump) return;
    const std::string function = jump->is_at_pole     ? "a quotient"
                                 : jump->what.empty() ? "if(...)"
                                                      : jump->what + "(...)";
    add({jump->within.empty() ? function : jump->within, false, range});
  };
  const auto look_at_mean = [&](const model::Expr& mean, const SourceRange& range) {
    const std::size_t before = result.size();
    const auto look = [&](const std::string& name, const model::Expr& formula) {
      const std::string inside = jump_inside_a_cell(session, formula);
      if (!inside.empty()) add({name, false, range, inside});
    };
    any_part(mean, [&](const model::Expr& part) {
      const model::Field* field = as<model::Field>(part);
      const model::Coefficient* c = field == nullptr ? nullptr : problem.find_coefficient(field->name);
      if (c != nullptr && c->value.formula) look(c->name, *c->value.formula);
      return false;
    });
    if (result.size() == before) look("if(...)", mean);
  };
  model::for_each_formula(problem, [&](const model::Use& use) {
    if (!is_written(use.kind)) return;
    any_part(use.formula, [&](const model::Expr& e) {
      const model::Derivative* d = as<model::Derivative>(e);
      if (d == nullptr || !holds_derivative(d->operand, d->axis)) return false;
      const SourceRange& range = e->origin.range.is_known() ? e->origin.range : use.origin.range;
      look_at_flux(without_harmonic_means(d->operand), range);
      for_each_harmonic_mean(d->operand, [&](const model::Expr& mean) { look_at_mean(mean, range); });
      return false;
    });
  });
  return result;
}

}  // namespace dpde::driver
