// SPDX-License-Identifier: Apache-2.0
#include "chart/reference.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "model/placement.h"

namespace dpde::chart {

namespace {

constexpr int points = 6;

/// Points of one axis and their weights, for a place between them.
struct Stencil {
  std::array<int, points> at{};
  std::array<double, points> weights{};
  int count = 0;
};

/// `place` in units of cells, 0 at the first point.
Stencil stencil_at(double place, int cells, bool is_periodic) {
  Stencil result;
  result.count = std::min(points, is_periodic ? points : cells);
  int first = static_cast<int>(std::floor(place)) - (result.count / 2 - 1);
  if (!is_periodic) first = std::clamp(first, 0, cells - result.count);
  for (int i = 0; i < result.count; ++i) {
    double weight = 1;
    for (int j = 0; j < result.count; ++j) {
      if (j != i) weight *= (place - first - j) / (i - j);
    }
    result.at[static_cast<std::size_t>(i)] = ((first + i) % cells + cells) % cells;
    result.weights[static_cast<std::size_t>(i)] = weight;
  }
  return result;
}

/// For each point of `to` along one axis. Coordinates that run uniformly are compared: maps of stretched axes are
/// equal.
std::vector<Stencil> stencils_along(const model::Axis& from, const model::Axis& to) {
  std::vector<Stencil> result;
  for (int i = 0; i < to.cells; ++i) {
    const double s = to.low + (i + 0.5) * to.spacing();
    result.push_back(
        stencil_at((s - from.low) / from.spacing() - 0.5, from.cells, from.topology == Topology::periodic));
  }
  return result;
}

double root_mean_square(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

double relative_difference(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> difference(a.size());
  std::ranges::transform(a, b, difference.begin(), std::minus());
  const double scale = root_mean_square(b);
  return root_mean_square(difference) / (scale > 0 ? scale : 1);
}

}  // namespace

FinalStates final_states(driver::Session& session) {
  FinalStates result;
  const model::Problem& problem = session.problem();
  for (int s = 0; s < session.rollout().state_count(); ++s) {
    const model::State* state = problem.find_state(session.rollout().state_name(s));
    if (state == nullptr || !state->history_of.empty()) continue;
    result[state->name] = {model::axes_at(session.axes(), state->placement), session.final_state(s)};
  }
  return result;
}

std::vector<double> at_points(const FinalState& state, const std::vector<model::Axis>& axes) {
  std::vector<double> values = state.values;
  std::size_t below = 1;  // points along the axes that are done
  for (std::size_t a = 0; a < axes.size(); ++a) {
    const std::vector<Stencil> stencils = stencils_along(state.axes[a], axes[a]);
    const auto from = static_cast<std::size_t>(state.axes[a].cells), to = static_cast<std::size_t>(axes[a].cells);
    const std::size_t above = values.size() / (below * from);
    std::vector<double> next(below * to * above, 0.0);
    for (std::size_t k = 0; k < above; ++k) {
      for (std::size_t i = 0; i < to; ++i) {
        const Stencil& stencil = stencils[i];
        for (std::size_t p = 0; p < static_cast<std::size_t>(stencil.count); ++p) {
          const double* source = &values[(k * from + static_cast<std::size_t>(stencil.at[p])) * below];
          for (std::size_t j = 0; j < below; ++j) next[(k * to + i) * below + j] += stencil.weights[p] * source[j];
        }
      }
    }
    values = std::move(next);
    below *= to;
  }
  return values;
}

Reference::Reference(FinalStates finest, FinalStates second, std::string text)
    : kind(Kind::finer_run), finest_(std::move(finest)), text_(std::move(text)) {
  for (const auto& [name, state] : second) {
    const std::vector<double> fine = at_points(finest_.at(name), state.axes);
    uncertainty_ = std::max(uncertainty_, relative_difference(state.values, fine));
  }
}

std::map<std::string, double> Reference::errors(driver::Session& session) const {
  std::map<std::string, double> result;
  if (kind == Kind::exact) {
    const std::vector<void*>& states = session.rollout().final_states();
    for (const driver::ErrorNorms& norm : session.errors(session.end_time(), states))
      result[norm.field] = norm.l2 / (norm.scale > 0 ? norm.scale : 1);
    return result;
  }
  for (const auto& [name, state] : final_states(session)) {
    if (finest_.contains(name))
      result[name] = relative_difference(state.values, at_points(finest_.at(name), state.axes));
  }
  return result;
}

}  // namespace dpde::chart
