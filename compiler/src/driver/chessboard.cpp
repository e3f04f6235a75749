// SPDX-License-Identifier: Apache-2.0
#include "driver/chessboard.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "dpde/runtime/field.h"
#include "model/build.h"
#include "model/metric.h"
#include "model/uses.h"

namespace dpde::driver {

namespace {

constexpr int cells_of_chessboards = 8, cells_of_noise = 32;  // fewer have jumps that are none
constexpr double unlike_neighbours = -0.1;
constexpr double driven_away = 1e16;       // times the variance at the start: of that W0801 speaks
constexpr double deviations_of_noise = 3;  // of white noise, whose neighbours have nothing to do with another
// What was smooth, or next to nothing, and has become noise: turbulence that its grid does not hold spreads evenly over
// all waves (measured: drift waves of a plasma 0.6 to 0.98 where they are resolved, 0.05 to -0.6 where they are not).
constexpr double noise = 0.2, smooth = 0.5, has_grown = 100;

/// A field as it lies in memory: no copy of it is made.
class StoredValues {
 public:
  StoredValues(const dpde_layout& layout, const void* base) : layout_(layout), base_(base) {
    for_each([&](const Cell& cell) { mean_ += at(cell); });
    mean_ /= static_cast<double>(count());
    for_each([&](const Cell& cell) { variance_ += (at(cell) - mean_) * (at(cell) - mean_); });
    variance_ /= static_cast<double>(count());
  }

  std::int64_t cells(std::size_t axis) const {
    return axis < static_cast<std::size_t>(layout_.rank) ? layout_.cells[axis] : 1;
  }
  std::int64_t count() const { return cells(0) * cells(1) * cells(2); }
  double variance() const { return variance_; }

  /// The correlation of neighbours along the axis: of waves of n cells cos(2*pi/n), of white noise 0.
  double neighbour_correlation(std::size_t axis) const {
    double sum = 0;
    for_each([&](Cell cell) {
      std::int64_t& along = axis == 0 ? cell.x : axis == 1 ? cell.y : cell.z;
      if (along + 1 == cells(axis)) return;
      const double here = at(cell) - mean_;
      ++along;
      sum += here * (at(cell) - mean_);
    });
    const auto pairs = static_cast<double>(count() / cells(axis) * (cells(axis) - 1));
    return variance_ > 0 && pairs > 0 ? sum / pairs / variance_ : 1;
  }

 private:
  double at(const Cell& cell) const { return value_at(layout_, base_, cell); }

  template <class Visit>
  void for_each(const Visit& visit) const {
    for (std::int64_t z = 0; z < cells(2); ++z) {
      for (std::int64_t y = 0; y < cells(1); ++y) {
        for (std::int64_t x = 0; x < cells(0); ++x) visit(Cell{x, y, z});
      }
    }
  }

  const dpde_layout& layout_;
  const void* base_;
  double mean_ = 0, variance_ = 0;
};

/// What no derivative joins is an ensemble; what noise drives is as rough as that.
bool is_of_neighbours(const model::Problem& problem, const model::State& state) {
  bool is_driven = false, is_joined = false;
  model::for_each_formula(problem, [&](const model::Use& use) {
    if (!model::makes_state(use.kind) || use.owner != state.name) return;
    is_driven = is_driven || std::ranges::any_of(problem.coefficients, [&](const model::Coefficient& c) {
                  return c.is_control() && reads(use.formula, c.name);
                });
    is_joined =
        is_joined || model::any_part(use.formula, [](const model::Expr& e) {
          return std::holds_alternative<model::Derivative>(e->kind) || std::holds_alternative<model::Advect>(e->kind);
        });
  });
  return state.rhs && is_joined && !is_driven;
}

}  // namespace

void report_chessboards(Session& session, DiagnosticSink& sink) {
  const model::Problem& problem = session.problem();
  for (int s = 0; s < session.rollout().state_count(); ++s) {
    const std::string& name = session.rollout().state_name(s);
    const model::State* state = problem.find_state(name);
    if (state == nullptr) continue;
    const dpde_layout& layout = session.workspace().layout();
    const StoredValues last(layout, session.rollout().final_states()[static_cast<std::size_t>(s)]),
        first(layout, session.rollout().initial(s).base());
    if (first.variance() > 0 && last.variance() > driven_away * first.variance()) continue;
    const double limit = unlike_neighbours - deviations_of_noise / std::sqrt(static_cast<double>(last.count()));
    for (std::size_t axis = 0; axis < problem.axes.size(); ++axis) {
      if (last.cells(axis) < cells_of_chessboards) continue;
      const double at_end = last.neighbour_correlation(axis);
      if (!(at_end < noise)) continue;
      const double at_start = first.neighbour_correlation(axis);
      const bool is_chessboard = at_end < limit && at_start >= limit;
      const bool is_new = at_start > smooth || last.variance() > has_grown * first.variance();
      const bool is_noise =
          is_new && first.variance() > 0 && last.cells(axis) >= cells_of_noise && is_of_neighbours(problem, *state);
      if (!is_chessboard && !is_noise) continue;
      sink.report("chessboard", state->origin.range,
                  {name, model::name_of_axis(problem, axis), is_chessboard ? "most" : "about half"},
                  "no difference knows such waves: take more cells, or damp them, as with nu*lap(" + name +
                      ") or upwind differences; where they come of rounding, a smaller step");
    }
  }
}

}  // namespace dpde::driver
