// SPDX-License-Identifier: Apache-2.0
// Spectral schemes: they need periodic, uniform axes and values at the cell centres.
#include <fmt/format.h>

#include <algorithm>

#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

/// The line of the scheme that requires Fourier series; "" if none does.
std::string row_of_waves(const Scheme& scheme) {
  if (is_exponential(scheme.time)) return fmt::format("time = {}", scheme.time->name);
  if (scheme.dealias) return "dealias = two_thirds";
  if (is_spectral(scheme.transport)) return "advect = spectral";
  for (const auto& [state, own] : scheme.transports) {
    if (is_spectral(own)) return fmt::format("advect {} = spectral", state);
  }
  if (scheme.derivative_order == spectral) return "dx = spectral";
  return scheme.laplacian_order == spectral ? "lap = spectral" : "";
}

/// Why a spectral scheme is impossible; "" if it is possible.
std::string obstacle_to_waves(const Problem& problem) {
  if (std::string what = obstacle_to_waves(problem.axes); !what.empty()) return what;
  for (const State& state : problem.states) {
    if (state.placement != Placement{}) return fmt::format("{} does not lie at the cell centres", state.name);
  }
  return "";
}

}  // namespace

std::string obstacle_to_waves(const std::vector<Axis>& axes) {
  for (const Axis& axis : axes) {
    if (axis.topology == Topology::bounded) return fmt::format("axis {} is bounded", axis.name);
    if (axis.stretch) return fmt::format("axis {} is stretched", axis.name);
  }
  return "";
}

void check_waves(Elaboration& elaboration) {
  const Problem& problem = elaboration.problem;
  const std::string row = row_of_waves(problem.scheme);
  if (row.empty() || !elaboration.blocks.model || problem.states.empty()) return;
  const SourceRange range = problem.states.front().origin.range;
  if (const std::string what = obstacle_to_waves(problem); !what.empty()) {
    elaboration.sink.report(
        "waves-do-not-fit", range, {row, what},
        "Fourier series need periodic axes of equal cells: take differences, as central(4), and rk4");
    return;
  }
  const bool has_parts = std::ranges::any_of(problem.states, [](const State& state) { return state.parts > 1; });
  if (has_parts && (is_exponential(problem.scheme.time) || problem.scheme.dealias))
    elaboration.sink.report("waves-do-not-fit", range, {row, "the scene has subcycles"}, "leave the subcycles out");
  if (is_exponential(problem.scheme.time) && problem.scheme.is_semi_lagrangian())
    elaboration.sink.report("waves-do-not-fit", range, {row, "advection is semi-Lagrangian"}, "take advect = spectral");
}

}  // namespace dpde::model
