// SPDX-License-Identifier: Apache-2.0
#include "driver/chessboard.h"

#include <cmath>
#include <numeric>
#include <vector>

namespace dpde::driver {

namespace {

constexpr int cells_of_chessboards = 8;
constexpr double unlike_neighbours = -0.1;
constexpr double driven_away = 1e16;       // times the variance at the start: of that W0801 speaks
constexpr double deviations_of_noise = 3;  // of white noise, whose neighbours have nothing to do with another

struct MeanAndVariance {
  double mean = 0, variance = 0;
};
MeanAndVariance mean_and_variance(const std::vector<double>& values) {
  const auto count = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / count;
  double sum = 0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  return {mean, sum / count};
}

/// The correlation of neighbours along the axis: of waves of n cells cos(2*pi/n), of white noise 0.
double neighbour_correlation(const std::vector<double>& values, std::size_t stride, std::size_t cells) {
  const MeanAndVariance spread = mean_and_variance(values);
  double sum = 0;
  std::size_t pairs = 0;
  for (std::size_t i = 0; i + stride < values.size(); ++i) {
    if (i / stride % cells + 1 == cells) continue;
    sum += (values[i] - spread.mean) * (values[i + stride] - spread.mean);
    ++pairs;
  }
  return spread.variance > 0 && pairs > 0 ? sum / static_cast<double>(pairs) / spread.variance : 1;
}

}  // namespace

void report_chessboards(Session& session, DiagnosticSink& sink) {
  const model::Problem& problem = session.problem();
  for (int s = 0; s < session.rollout().state_count(); ++s) {
    const std::string& name = session.rollout().state_name(s);
    const model::State* state = problem.find_state(name);
    if (state == nullptr) continue;
    const std::vector<double> last = session.final_state(s);
    std::vector<double> first(last.size());
    session.rollout().initial(s).copy_out(first);
    const double begin = mean_and_variance(first).variance;
    if (begin > 0 && mean_and_variance(last).variance > driven_away * begin) continue;
    const double limit = unlike_neighbours - deviations_of_noise / std::sqrt(static_cast<double>(last.size()));
    std::size_t stride = 1;
    for (std::size_t axis = 0; axis < problem.axes.size(); ++axis) {
      const auto cells = static_cast<std::size_t>(problem.axes[axis].cells);
      const bool is_chessboard = cells >= cells_of_chessboards && neighbour_correlation(last, stride, cells) < limit &&
                                 neighbour_correlation(first, stride, cells) >= limit;
      if (is_chessboard)
        sink.report("chessboard", state->origin.range, {name, problem.axes[axis].name},
                    "no difference knows such waves: take more cells, or damp them, as with nu*lap(" + name +
                        ") or upwind differences; where they come of rounding, a smaller step");
      stride *= cells;
    }
  }
}

}  // namespace dpde::driver
