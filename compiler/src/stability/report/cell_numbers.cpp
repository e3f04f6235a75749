// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/build.h"
#include "model/uses.h"
#include "stability/equations.h"
#include "stability/frozen/consistent_start.h"
#include "stability/frozen/frozen_points.h"
#include "stability/report/local_character.h"

namespace dpde::stability {

namespace {

constexpr double largest_smooth = 2;
constexpr double rounding_of_sums = 1e-9;  // relative
constexpr double upwinding = 0.05;         // of |a|*h: numerical diffusion of the shortest wave

/// Speed and diffusion of a row for its own field along one axis.
struct Transport {
  double speed = 0, diffusion = 0;
  double at_grid_scale = 0;  // diffusion of the wave of two cells
};

Transport transport_of(const LinearisedStep& response, std::size_t row, std::size_t axis, double spacing) {
  Transport found;
  double size = 0;
  for (const LinearForm::Term& term : response.rows[row].terms()) {
    if (LinearForm::component_of(term.key) != static_cast<int>(row)) continue;
    const double k = LinearForm::offset_of(term.key)[axis];
    found.speed -= spacing * k * term.coefficient;
    found.diffusion += 0.5 * spacing * spacing * k * k * term.coefficient;
    found.at_grid_scale += 0.25 * spacing * spacing * (1 - std::cos(std::numbers::pi * k)) * term.coefficient;
    size += std::abs(term.coefficient);
  }
  if (std::abs(found.speed) < rounding_of_sums * size * spacing) found.speed = 0;
  if (found.diffusion < rounding_of_sums * size * spacing * spacing) found.diffusion = 0;
  return found;
}

/// The problem with differences instead of spectral derivatives: rows contain weights of differences only.
model::Problem without_waves(model::Problem problem) {
  model::Scheme& scheme = problem.scheme;
  if (model::is_spectral(scheme.transport)) scheme.transport = {};
  for (auto& [state, own] : scheme.transports) {
    if (model::is_spectral(own)) own = {};
  }
  for (int* order : {&scheme.derivative_order, &scheme.laplacian_order}) {
    if (*order == model::spectral) *order = 2;
  }
  scheme.dealias = false;
  return problem;
}

model::Problem with_central_advection(model::Problem problem) {
  problem.scheme.transport = {};
  problem.scheme.transports.clear();
  return without_waves(std::move(problem));
}

/// Whether the problem's own differences are others.
bool has_other_differences(const model::Problem& problem) {
  const model::Scheme& scheme = problem.scheme;
  if (scheme.dealias || scheme.derivative_order == model::spectral || scheme.laplacian_order == model::spectral)
    return true;
  const auto is_advect = [](const model::Expr& e) { return is<model::Advect>(e); };
  return model::any_formula(problem, [&](const model::Use& use) { return any_part(use.formula, is_advect); });
}

/// Whether the speed depends on the value of the field.
bool carries_itself(const LinearStep& linear, FrozenPoint point, const std::string& field, std::size_t row,
                    std::size_t axis, double spacing, double speed) {
  const auto own = point.fields.find(field);
  if (own == point.fields.end()) return false;
  own->second.value = own->second.value == 0 ? 1 : 2 * own->second.value;
  const std::optional<LinearisedStep> other = generator_of(linear, point);
  return other && std::abs(transport_of(*other, row, axis, spacing).speed - speed) > rounding_of_sums * std::abs(speed);
}

class LargestNumbers {
 public:
  LargestNumbers(driver::Session& session, const LinearStep& central, const std::optional<LinearStep>& own)
      : session_(session), central_(central), own_(own) {}

  std::vector<CellNumber> run() {
    for (const ScenePoint& point : all_frozen_points(session_, central_)) look_at(point);
    if (central_.solves()) {
      for (const ScenePoint& point : steepest_points(session_, central_)) look_at(point);
    }
    for (CellNumber& found : found_) found.rings = found.rings && (may_become_steep(found) || is_steep(found));
    return std::move(found_);
  }

 private:
  /// Whether the field can steepen itself, or meets a wall.
  bool may_become_steep(const CellNumber& found) const {
    return found.is_reynolds || session_.axes()[static_cast<std::size_t>(found.axis)].topology == Topology::bounded;
  }

  /// Whether neighbouring cells differ visibly: oscillations at a layer are a fraction of that difference.
  bool is_steep(const CellNumber& found) const {
    constexpr double seen = 1e-2;  // of the range of the field
    const int state = session_.engine().state_index(found.field);
    if (state < 0) return true;
    const std::vector<double> values = session_.initial(state);
    std::size_t stride = 1, cells = 1;
    for (std::size_t axis = 0; axis < session_.axes().size(); ++axis) {
      cells = static_cast<std::size_t>(session_.axes()[axis].cells);
      if (static_cast<int>(axis) == found.axis) break;
      stride *= cells;
    }
    double largest = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::size_t place = i / stride % cells, next = place + 1 < cells ? i + stride : i - place * stride;
      largest = std::max(largest, std::abs(values[next] - values[i]));
    }
    const auto [low, high] = std::ranges::minmax(values);
    return largest > seen * (high - low);
  }

  void look_at(const ScenePoint& at) {
    const FrozenPoint point = flat(at.point);
    const std::optional<LinearisedStep> rows = generator_of(central_, point);
    const std::optional<LinearisedStep> own = own_ ? generator_of(*own_, point) : std::nullopt;
    if (!rows) return;
    for (std::size_t row = 0; row < rows->rows.size(); ++row) {
      for (std::size_t axis = 0; axis < session_.axes().size(); ++axis) {
        const double h = session_.axes()[axis].spacing();
        const Transport t = transport_of(*rows, row, axis, h);
        if (t.speed == 0) continue;
        CellNumber next{central_.states()[row], static_cast<int>(axis), std::abs(t.speed), t.diffusion};
        next.number = t.diffusion > 0 ? next.speed * h / t.diffusion : std::numeric_limits<double>::infinity();
        const bool is_central =
            own && transport_of(*own, row, axis, h).at_grid_scale - t.at_grid_scale < upwinding * next.speed * h;
        next.rings = is_central && t.diffusion > 0 && next.number > largest_smooth;
        next.place = at.place;
        CellNumber* const known = find(next.field, next.axis);
        constexpr double more_than_rounding = 1 + 1e-9;  // of symmetric points the first is reported
        if (known != nullptr && !(next.number > more_than_rounding * known->number)) continue;
        // needs another response, so it is computed only for numbers that are stored
        next.is_reynolds = carries_itself(central_, point, next.field, row, axis, h, t.speed);
        if (known == nullptr) {
          found_.push_back(next);
        } else {
          *known = next;
        }
      }
    }
  }

  CellNumber* find(const std::string& field, int axis) {
    const auto known =
        std::ranges::find_if(found_, [&](const CellNumber& c) { return c.field == field && c.axis == axis; });
    return known == found_.end() ? nullptr : &*known;
  }

  driver::Session& session_;
  const LinearStep& central_;
  const std::optional<LinearStep>& own_;
  std::vector<CellNumber> found_;
};

/// The first advect(...) of the field's equation.
SourceRange transport_of(const model::Problem& problem, const std::string& field) {
  const model::State* state = problem.find_state(field);
  SourceRange range = state == nullptr ? SourceRange{} : state->origin.range;
  if (state == nullptr || !state->rhs) return range;
  any_part(*state->rhs, [&](const model::Expr& e) {
    const bool is_transport = is<model::Advect>(e) && e->origin.range.is_known();
    if (is_transport) range = e->origin.range;
    return is_transport;
  });
  return range;
}

/// Whether the scheme adds negative diffusion to a row along an axis.
bool looks_downwind(const LinearisedStep& own, const LinearisedStep& central, std::size_t row,
                    const std::vector<model::Axis>& axes) {
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    const double h = axes[axis].spacing();
    const Transport plain = transport_of(central, row, axis, h);
    const double added = transport_of(own, row, axis, h).at_grid_scale - plain.at_grid_scale;
    if (added < -upwinding * std::abs(plain.speed) * h) return true;
  }
  return false;
}

}  // namespace

std::vector<Downwind> downwind_differences(driver::Session& session) {
  const model::Problem problem = by_euler(session.problem());
  if (problem.scheme.is_semi_lagrangian() || !problem.program.empty() || !has_other_differences(problem)) return {};
  const std::optional<LinearStep> central = linear_step(with_central_advection(problem)),
                                  own = linear_step(without_waves(problem));
  if (!central || !own || central->states() != own->states()) return {};
  std::vector<Downwind> found;
  for (const ScenePoint& at : all_frozen_points(session, *central)) {
    const FrozenPoint point = flat(at.point);
    const std::optional<LinearisedStep> plain = generator_of(*central, point), rows = generator_of(*own, point);
    for (std::size_t row = 0; plain && rows && row < rows->rows.size(); ++row) {
      const std::string& field = central->states()[row];
      if (std::ranges::find(found, field, &Downwind::field) != found.end()) continue;
      if (looks_downwind(*rows, *plain, row, session.axes()))
        found.push_back({field, transport_of(session.problem(), field), at.place});
    }
  }
  return found;
}

std::string downwind_text(const Downwind& found) {
  return "a term + advect(v, " + found.field + ") carries " + found.field +
         " with -v, and its differences look to where v comes from: write - advect(-v, " + found.field + ")";
}

std::vector<CellNumber> cell_numbers(driver::Session& session) {
  const ConsistentStart start(session);
  const model::Problem problem = by_euler(session.problem());
  const std::optional<LinearStep> central = linear_step(with_central_advection(problem));
  if (!central) return {};
  const std::optional<LinearStep> own = problem.scheme.is_semi_lagrangian() ? std::nullopt
                                        : !has_other_differences(problem)   ? central
                                                                            : linear_step(problem);
  return LargestNumbers(session, *central, own).run();
}

}  // namespace dpde::stability
