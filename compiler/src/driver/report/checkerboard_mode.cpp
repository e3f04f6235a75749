// SPDX-License-Identifier: Apache-2.0
#include "driver/report/checkerboard_mode.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <vector>

#include "dpde/runtime/field.h"
#include "model/boundary/metric.h"
#include "model/build.h"
#include "model/uses.h"

namespace dpde::driver {

namespace {

constexpr int cells_of_chessboards = 8, cells_of_noise = 32;  // with fewer cells, smooth fields look like jumps
constexpr double unlike_neighbours = -0.1;
constexpr double driven_away = 1e16;       // times the variance at the start; W0801 reports such growth
constexpr double deviations_of_noise = 3;  // tolerance for white noise, whose neighbours are uncorrelated
// A field that was smooth or negligible and has become noise: turbulence that the grid does not resolve spreads evenly
// over all waves (correlation of neighbours, drift waves of a plasma: 0.6 to 0.98 if resolved, 0.05 to -0.6 if not).
constexpr double noise = 0.2, smooth = 0.5, has_grown = 100;

/// View of a stored field, without a copy.
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

  /// Correlation of neighbours along the axis: cos(2*pi/n) for waves of n cells, 0 for white noise.
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

/// Excludes states without derivatives, which are ensembles, and states driven by noise, which are as rough as it.
bool is_of_neighbours(const model::Problem& problem, const model::State& state) {
  bool is_driven = false, is_joined = false;
  model::for_each_formula(problem, [&](const model::Use& use) {
    if (!model::makes_state(use.kind) || use.owner != state.name) return;
    is_driven = is_driven || std::ranges::any_of(problem.coefficients, [&](const model::Coefficient& c) {
                  return c.is_control() && reads(use.formula, c.name);
                });
    is_joined = is_joined || holds_any<model::Derivative, model::Advect>(use.formula);
  });
  return state.rhs && is_joined && !is_driven;
}

/// Spectrum along an axis, summed over some lines of the field: squares of the modes 1, 2, ... up to the last one that
/// `dealias = two_thirds` keeps.
std::vector<double> spectrum_to_cut(const std::vector<double>& values, const std::array<std::int64_t, 3>& cells,
                                    std::size_t axis) {
  constexpr std::int64_t most_lines = 64;
  std::int64_t stride = 1;
  for (std::size_t a = 0; a < axis; ++a) stride *= cells[a];
  const std::int64_t n = cells[axis], lines = static_cast<std::int64_t>(values.size()) / n,
                     apart = std::max<std::int64_t>(1, lines / most_lines);
  std::vector<double> sums(static_cast<std::size_t>((n - 1) / 3), 0.0);
  for (std::int64_t line = 0; line < lines; line += apart) {
    const std::int64_t first = line / stride * stride * n + line % stride;
    for (std::size_t m = 0; m < sums.size(); ++m) {
      const std::complex<double> turn =
          std::polar(1.0, -2 * std::numbers::pi * static_cast<double>(m + 1) / static_cast<double>(n));
      std::complex<double> wave = 0;  // Horner's rule
      for (std::int64_t i = n; i-- > 0;) wave = wave * turn + values[static_cast<std::size_t>(first + i * stride)];
      sums[m] += std::norm(wave);
    }
  }
  return sums;
}

/// Whether the waves beyond the cut would hold more than a hundredth of the energy, i.e. a tenth of the amplitude.
/// Extrapolates the ratio of the last two thirds of the spectrum; a spectrum that rises to the cut is not bounded.
bool is_cut_off(const std::vector<double>& spectrum) {
  constexpr double told = 1e-2;
  const auto part = [&](std::size_t third) {
    const auto begin = spectrum.begin() + static_cast<std::ptrdiff_t>(third * spectrum.size() / 3),
               end = spectrum.begin() + static_cast<std::ptrdiff_t>((third + 1) * spectrum.size() / 3);
    return std::accumulate(begin, end, 0.0);
  };
  const double before = part(1), last = part(2), all = part(0) + before + last;
  return last >= before ? last > told * all : last * last / (before - last) > told * all;
}

/// Dealiasing removes the shortest waves, so energy piles up just below its cut.
void report_pile_up(Session& session, int s, const model::State& state, DiagnosticSink& sink) {
  const model::Problem& problem = session.problem();
  std::array<std::int64_t, 3> cells{1, 1, 1};
  for (std::size_t axis = 0; axis < problem.axes.size(); ++axis) cells[axis] = problem.axes[axis].cells;
  const std::vector<double> last = session.final_state(s);
  for (std::size_t axis = 0; axis < problem.axes.size(); ++axis) {
    if (cells[axis] < cells_of_noise) continue;
    if (!is_cut_off(spectrum_to_cut(last, cells, axis))) continue;
    sink.report(
        "chessboard", state.origin.range, {session.rollout().state_name(s), model::name_of_axis(problem, axis), "much"},
        "its spectrum does not fall to where dealias = two_thirds cuts it: take more cells, or damp such waves, as "
        "with nu*lap(" +
            session.rollout().state_name(s) + ")");
  }
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
    if (problem.scheme.dealias && is_of_neighbours(problem, *state)) report_pile_up(session, s, *state, sink);
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
                  "differences do not resolve such waves: take more cells, or damp them, as with nu*lap(" + name +
                      ") or upwind differences; where they come of rounding, a smaller step");
    }
  }
}

}  // namespace dpde::driver
