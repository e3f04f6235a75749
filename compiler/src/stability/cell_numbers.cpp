// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include "stability/consistent_start.h"
#include "stability/equations.h"
#include "stability/frozen_points.h"
#include "stability/local_character.h"

namespace dpde::stability {

namespace {

constexpr double largest_smooth = 2;
constexpr double rounding_of_sums = 1e-9;  // relative
constexpr double upwinding = 0.05;         // of |a|*h: diffusion of the shortest wave that is the scheme's own

/// Of what a row does to its own field along one axis.
struct Transport {
  double speed = 0, diffusion = 0;
  double at_grid_scale = 0;  // diffusion that the wave of two cells sees
};

Transport transport_of(const Response& response, std::size_t row, std::size_t axis, double spacing) {
  Transport found;
  double size = 0;
  for (const Form::Term& term : response.rows[row].terms()) {
    if (Form::component_of(term.key) != static_cast<int>(row)) continue;
    const double k = Form::offset_of(term.key)[axis];
    found.speed -= spacing * k * term.coefficient;
    found.diffusion += 0.5 * spacing * spacing * k * k * term.coefficient;
    found.at_grid_scale += 0.25 * spacing * spacing * (1 - std::cos(std::numbers::pi * k)) * term.coefficient;
    size += std::abs(term.coefficient);
  }
  if (std::abs(found.speed) < rounding_of_sums * size * spacing) found.speed = 0;
  if (found.diffusion < rounding_of_sums * size * spacing * spacing) found.diffusion = 0;
  return found;
}

model::Problem with_central_advection(model::Problem problem) {
  problem.scheme.transport = {};
  problem.scheme.transports.clear();
  for (int* order : {&problem.scheme.derivative_order, &problem.scheme.laplacian_order}) {
    if (*order == model::spectral) *order = 2;
  }
  problem.scheme.dealias = false;
  return problem;
}

/// Whether the speed is another one where the field has another value.
bool carries_itself(const LinearStep& linear, FrozenPoint point, const std::string& field, std::size_t row,
                    std::size_t axis, double spacing, double speed) {
  const auto own = point.fields.find(field);
  if (own == point.fields.end()) return false;
  own->second.value = own->second.value == 0 ? 1 : 2 * own->second.value;
  const std::optional<Response> other = generator_of(linear, point);
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
    return std::move(found_);
  }

 private:
  void look_at(const ScenePoint& at) {
    const FrozenPoint point = flat(at.point);
    const std::optional<Response> rows = generator_of(central_, point);
    const std::optional<Response> own = own_ ? generator_of(*own_, point) : std::nullopt;
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
        next.is_reynolds = carries_itself(central_, point, next.field, row, axis, h, t.speed);
        next.place = at.place;
        take(next);
      }
    }
  }

  void take(const CellNumber& next) {
    const auto known =
        std::ranges::find_if(found_, [&](const CellNumber& c) { return c.field == next.field && c.axis == next.axis; });
    if (known == found_.end()) {
      found_.push_back(next);
    } else if (next.number > known->number) {
      *known = next;
    }
  }

  driver::Session& session_;
  const LinearStep& central_;
  const std::optional<LinearStep>& own_;
  std::vector<CellNumber> found_;
};

}  // namespace

std::vector<CellNumber> cell_numbers(driver::Session& session) {
  const ConsistentStart start(session);
  const model::Problem problem = by_euler(session.problem());
  const std::optional<LinearStep> central = linear_step(with_central_advection(problem));
  if (!central) return {};
  const std::optional<LinearStep> own = problem.scheme.follows_flow() ? std::nullopt : linear_step(problem);
  return LargestNumbers(session, *central, own).run();
}

}  // namespace dpde::stability
