// SPDX-License-Identifier: Apache-2.0
#include "stability/report/ill_posed.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "stability/eigenvalues/eigenvalues.h"
#include "stability/equations.h"
#include "stability/frozen/frozen_points.h"

namespace dpde::stability {

namespace {

using std::numbers::pi;

/// Cells are narrower than the scene's by this factor: only the terms of highest order matter there.
constexpr double far_shorter = 256;
/// Least Re(s)/|s| of an eigenvalue s that surely grows; rounding and terms of lower order give less.
constexpr double sure_part = 1e-3;
constexpr double rounding = 1e-9;  // of the largest eigenvalue
/// Threshold between bounded growth (order 0) and order 1.
constexpr double least_order = 0.5;

/// Wave vectors of one length, in radians per cell: along each axis, and along several.
std::vector<Angles> directions(int rank, double angle) {
  std::vector<Angles> result;
  for (int code = 1; code < static_cast<int>(std::pow(3, rank)); ++code) {
    const std::array<int, 3> sign{code % 3 - 1, rank > 1 ? code / 3 % 3 - 1 : 0, rank > 2 ? code / 9 - 1 : 0};
    if (sign > std::array{0, 0, 0}) result.push_back({sign[0] * angle, sign[1] * angle, sign[2] * angle});
  }
  return result;
}

/// The largest sure growth rate of all waves of that length; 0 if none grows. Rows in addition to the states, as the
/// initial guess of a solve, have no equation and no rates.
Largest growth_of(const Symbol& symbol, int rank, double angle) {
  Largest largest;
  for (const Angles& wave : directions(rank, angle)) {
    const Eigen::VectorXcd rates = symbol.eigenvalues(wave);
    const double fastest = rates.size() > 0 ? rates.cwiseAbs().maxCoeff() : 0;
    for (const std::complex<double> s : rates) {
      const bool is_sure = s.real() > sure_part * std::abs(s) && s.real() > rounding * fastest;
      if (is_sure && s.real() > largest.value) largest = {wave, s.real()};
    }
  }
  return largest;
}

FrozenPoint on_narrower_cells(FrozenPoint point, const std::vector<model::Axis>& axes) {
  for (const model::Axis& axis : axes) point.params.at("h" + axis.name) /= far_shorter;
  for (auto* fields : {&point.fields, &point.whole}) {
    for (auto& [name, field] : *fields) {
      for (double& slope : field.slope) slope /= far_shorter;
    }
  }
  return point;
}

std::optional<IllPosed> ill_posed_at(const Equations& equations, const ScenePoint& at,
                                     const std::vector<model::Axis>& axes) {
  const int rank = static_cast<int>(axes.size());
  const std::optional<Symbol> of_grid = equations.about(at.point);
  const double on_grid = of_grid ? growth_of(*of_grid, rank, pi).value : 0;
  if (!(on_grid > 0)) return std::nullopt;
  const std::optional<Symbol> far = equations.about(on_narrower_cells(at.point, axes));
  if (!far) return std::nullopt;
  const double longer = growth_of(*far, rank, pi).value, shorter = growth_of(*far, rank, 2 * pi).value;
  const double order = longer > 0 ? std::log2(shorter / longer) : 0;
  if (!(order > least_order) || !(shorter > on_grid)) return std::nullopt;
  return IllPosed{static_cast<int>(std::lround(order)), 1 / on_grid, "", at.place};
}

}  // namespace

std::optional<IllPosed> ill_posed(driver::Session& session) {
  if (!session.problem().program.empty()) return std::nullopt;
  std::optional<IllPosed> worst;
  for (const StateGroup& group : state_groups(session)) {
    std::string why;
    const std::optional<LinearStep> linear = linear_step(session, why, group);
    if (!linear || linear->is_semi_lagrangian()) continue;
    const Equations equations(session.problem(), linear->group());
    for (const ScenePoint& point : all_frozen_points(session, *linear)) {
      std::optional<IllPosed> found = ill_posed_at(equations, point, session.problem().axes);
      if (!found || (worst && worst->time <= found->time)) continue;
      found->field = linear->states().front();
      worst = std::move(found);
    }
  }
  return worst;
}

std::string ill_posed_text(const IllPosed& found) {
  return fmt::format(
      "growth of the shortest waves rises as 1/h{}, here by a factor of e in {:.4g}{}: on finer cells it is faster, in "
      "steps of any length",
      found.order == 1 ? "" : fmt::format("^{}", found.order), found.time,
      found.place.empty() ? "" : " at " + found.place);
}

std::string ill_posed_help() {
  return "look at signs: lap(u) has a positive coefficient, lap(lap(u)) a negative one, and dt(u) = c*dx(v) has "
         "dt(v) = c*dx(u) as its partner";
}

}  // namespace dpde::stability
