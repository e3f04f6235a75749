// SPDX-License-Identifier: Apache-2.0
#include "chart/reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "model/analyse/placement.h"
#include "support/assert.h"

namespace dpde::chart {

namespace {

constexpr int points = 6;

/// Points along one axis and their interpolation weights.
struct Stencil {
  std::array<int, points> at{};
  std::array<double, points> weights{};
  int count = 0;
};

/// `place`: position in cells, 0 at the first point.
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

/// For each point of `to` along one axis. Uses the uniform coordinates, since maps of stretched axes are equal.
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

double norm_of(const driver::ErrorNorms& norms, model::ErrorNorm norm) {
  switch (norm) {
    case model::ErrorNorm::l1: return norms.l1;
    case model::ErrorNorm::l2: return norms.l2;
    case model::ErrorNorm::linf: return norms.linf;
  }
  unreachable("norm of errors");
}

/// The measures requested for a state; l2 if none are.
std::vector<Measure> measures_of(const std::string& state, const std::vector<Measure>& measures) {
  if (measures.empty()) return {{state}};
  std::vector<Measure> own;
  std::ranges::copy_if(measures, std::back_inserter(own), [&](const Measure& m) { return m.state == state; });
  return own;
}

}  // namespace

double norm_of(const std::vector<double>& values, model::ErrorNorm norm) {
  double sum = 0, largest = 0;
  for (const double v : values) {
    sum += std::abs(v);
    largest = std::abs(v) > largest || std::isnan(v) ? std::abs(v) : largest;
  }
  switch (norm) {
    case model::ErrorNorm::l1: return sum / static_cast<double>(values.size());
    case model::ErrorNorm::l2: return root_mean_square(values);
    case model::ErrorNorm::linf: return largest;
  }
  unreachable("norm of errors");
}

double relative_difference(const std::vector<double>& a, const std::vector<double>& b, model::ErrorNorm norm) {
  std::vector<double> difference(a.size());
  std::ranges::transform(a, b, difference.begin(), std::minus());
  const double scale = root_mean_square(b);
  return norm_of(difference, norm) / (scale > 0 ? scale : 1);
}

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

FinalStates final_states(driver::Session& session, const std::vector<double>& values) {
  FinalStates result;
  const model::Problem& problem = session.problem();
  const auto size = static_cast<std::ptrdiff_t>(session.workspace().cell_count());
  for (int s = 0; s < session.rollout().state_count() && (s + 1) * size <= std::ssize(values); ++s) {
    const model::State* state = problem.find_state(session.rollout().state_name(s));
    if (state == nullptr || !state->history_of.empty()) continue;
    result[state->name] = {model::axes_at(session.axes(), state->placement),
                           {values.begin() + s * size, values.begin() + (s + 1) * size}};
  }
  return result;
}

std::vector<double> at_points(const FinalState& state, const std::vector<model::Axis>& axes) {
  std::vector<double> values = state.values;
  std::size_t below = 1;  // points along the axes already interpolated
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

std::string text_of(const Measure& measure) {
  return measure.norm == model::ErrorNorm::l2 ? measure.state
                                              : fmt::format("{}({})", model::name_of(measure.norm), measure.state);
}

Reference::Reference(FinalStates finest, FinalStates second, const std::vector<Measure>& measures, std::string text)
    : kind(Kind::finer_run), finest_(std::move(finest)), text_(std::move(text)) {
  for (const auto& [name, state] : second) {
    const std::vector<double> fine = at_points(finest_.at(name), state.axes);
    for (const Measure& measure : measures_of(name, measures))
      uncertainty_ = std::max(uncertainty_, relative_difference(state.values, fine, measure.norm));
  }
}

std::map<std::string, double> Reference::errors(driver::Session& session, const std::vector<Measure>& measures) const {
  std::map<std::string, double> result;
  if (kind == Kind::exact) {
    const std::vector<void*>& states = session.rollout().final_states();
    for (const driver::ErrorNorms& norms : session.errors(session.end_time(), states)) {
      for (const Measure& measure : measures_of(norms.field, measures))
        result[text_of(measure)] = norm_of(norms, measure.norm) / (norms.scale > 0 ? norms.scale : 1);
    }
    return result;
  }
  for (const auto& [name, state] : final_states(session)) {
    if (!finest_.contains(name)) continue;
    const std::vector<double> fine = at_points(finest_.at(name), state.axes);
    for (const Measure& measure : measures_of(name, measures))
      result[text_of(measure)] = relative_difference(state.values, fine, measure.norm);
  }
  return result;
}

}  // namespace dpde::chart
