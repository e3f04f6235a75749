// SPDX-License-Identifier: Apache-2.0
#include "model/boundary/metric.h"

#include <cmath>
#include <functional>

#include "model/analyse/formula.h"
#include "model/analyse/placement.h"
#include "model/build.h"
#include "support/assert.h"

namespace dpde::model {

namespace {

constexpr double smallest_length = 1e-9;  // of a unit at a pole, relative to that inside: cos(pi/2) is not exactly 0

using Place = std::array<double, 3>;

/// Calls `f` for each cell along x, y and z.
void for_each_cell(const std::vector<Axis>& axes, const std::function<void(const std::array<int, 3>&)>& f) {
  std::array<int, 3> cells{1, 1, 1};
  for (std::size_t a = 0; a < axes.size(); ++a) cells[a] = axes[a].cells;
  std::array<int, 3> cell{};
  for (cell[2] = 0; cell[2] < cells[2]; ++cell[2]) {
    for (cell[1] = 0; cell[1] < cells[1]; ++cell[1]) {
      for (cell[0] = 0; cell[0] < cells[0]; ++cell[0]) f(cell);
    }
  }
}

/// Centres and widths along each axis.
struct Cells {
  std::array<std::vector<double>, 3> centres{{{0}, {0}, {0}}}, widths{{{1}, {1}, {1}}};

  explicit Cells(const std::vector<Axis>& axes) {
    for (std::size_t a = 0; a < axes.size(); ++a) {
      centres[a].clear();
      widths[a].clear();
      for (int i = 0; i < axes[a].cells; ++i) {
        centres[a].push_back(axes[a].centre(i));
        widths[a].push_back(axes[a].width(i));
      }
    }
  }
  Place place(const std::array<int, 3>& cell) const {
    Place place{};
    for (std::size_t a = 0; a < 3; ++a) place[a] = centres[a][static_cast<std::size_t>(cell[a])];
    return place;
  }
  double volume(const std::array<int, 3>& cell) const {
    double product = 1;
    for (std::size_t a = 0; a < 3; ++a) product *= widths[a][static_cast<std::size_t>(cell[a])];
    return product;
  }
};

/// Whether values beyond the poles at one or both ends of an axis are read.
struct ReadsAcross {
  const Problem& problem;
  std::size_t axis;
  bool low, high;

  bool operator()(const Expr& e, bool in_flux) const {
    if (const auto* advect = as<Advect>(e)) return !is_literal(advect->velocity[axis], 0);
    if (is<Solve>(e)) return false;
    const auto* slope = as<Derivative>(e);
    if (slope != nullptr && slope->axis == static_cast<int>(axis) && holds_any<Field>(slope->operand)) {
      if (slope->order > 1) return true;
      if (in_flux) return (*this)(slope->operand, false);
      const Expr* flux = flux_in(slope->operand);
      return flux == nullptr || (*this)(*flux, true);
    }
    return any_child(e, [&](const Expr& part) { return (*this)(part, in_flux); });
  }

 private:
  /// The factor of a face area that vanishes at the pole, so that beyond it nothing is read; wider differences read
  /// further faces.
  const Expr* flux_in(const Expr& e) const {
    const auto* product = as<Binary>(e);
    const bool is_flux =
        product != nullptr && product->op == BinaryOp::multiply && problem.scheme.derivative_order == 2;
    if (!is_flux || !is_formula(product->left)) return nullptr;
    const bool vanishes = (!low || vanishes_at(problem, product->left, axis, true)) &&
                          (!high || vanishes_at(problem, product->left, axis, false));
    return vanishes ? &product->right : nullptr;
  }
};

}  // namespace

bool vanishes_at(const Problem& problem, const Expr& length, std::size_t axis, bool is_low) {
  if (!is_formula(length)) return false;
  const Axis& along = problem.axes[axis];
  Place place{}, beside{};
  for (std::size_t a = 0; a < problem.axes.size(); ++a) place[a] = beside[a] = problem.axes[a].centre(0);
  place[axis] = is_low ? along.low : along.high;
  beside[axis] = 0.5 * (along.low + along.high);
  return std::abs(value_at(length, place)) < smallest_length * std::abs(value_at(length, beside));
}

bool is_pole_at(const Problem& problem, std::size_t axis, bool is_low) {
  if (!problem.metric || problem.axes[axis].topology == Topology::periodic) return false;
  for (std::size_t other = 0; other < problem.axes.size(); ++other) {
    const Expr& scale = problem.metric->scales[other];
    if (other != axis && depends_on_axis(scale, static_cast<int>(axis)) && vanishes_at(problem, scale, axis, is_low))
      return true;
  }
  return false;
}

bool has_pole(const Problem& problem) {
  for (std::size_t axis = 0; axis < problem.axes.size(); ++axis) {
    if (is_pole_at(problem, axis, true) || is_pole_at(problem, axis, false)) return true;
  }
  return false;
}

std::string name_of_axis(const Problem& problem, std::size_t axis) {
  const bool has_name = problem.metric && axis < problem.metric->axes.size();
  return has_name ? problem.metric->axes[axis] : problem.axes[axis].name;
}

std::string name_of_side(const Problem& problem, std::size_t axis, bool is_low) {
  const std::string written = side_name(problem.axes[axis], is_low);
  return name_of_axis(problem, axis) + written.substr(written.find('.'));
}

bool falls_towards_poles(const Problem& problem, const Expr& factor) {
  for (std::size_t axis = 0; axis < problem.axes.size(); ++axis) {
    for (const bool is_low : {true, false}) {
      if (!is_pole_at(problem, axis, is_low)) continue;
      for (std::size_t other = 0; other < problem.axes.size(); ++other) {
        const Expr& scale = problem.metric->scales[other];
        if (other == axis || !vanishes_at(problem, scale, axis, is_low)) continue;
        if (!vanishes_at(problem, binary(BinaryOp::divide, factor, scale), axis, is_low)) return false;
      }
    }
  }
  return true;
}

double length_of_poles(const Problem& problem, std::size_t axis, std::size_t around) {
  Place middle{};
  for (std::size_t a = 0; a < problem.axes.size(); ++a) middle[a] = problem.axes[a].centre(0);
  middle[axis] = 0.5 * (problem.axes[axis].low + problem.axes[axis].high);
  return smallest_length * std::abs(value_at(problem.metric->scales[around], middle));
}

bool reads_across_pole(const Problem& problem, const Expr& e) {
  for (std::size_t axis = 0; axis < problem.axes.size(); ++axis) {
    const bool low = is_pole_at(problem, axis, true), high = is_pole_at(problem, axis, false);
    if ((low || high) && ReadsAcross{problem, axis, low, high}(e, false)) return true;
  }
  return false;
}

std::string word_of(CoordinateSystem system) {
  switch (system) {
    case CoordinateSystem::given: return "metric";
    case CoordinateSystem::polar: return "polar";
    case CoordinateSystem::cylinder: return "cylinder";
    case CoordinateSystem::sphere: return "sphere";
  }
  unreachable("coordinate system");
}

CoordinateSystem system_of(const std::string& word) {
  for (const CoordinateSystem system :
       {CoordinateSystem::polar, CoordinateSystem::cylinder, CoordinateSystem::sphere}) {
    if (word_of(system) == word) return system;
  }
  return CoordinateSystem::given;
}

Expr size_of(const Metric& metric, const std::array<bool, 3>& over, std::size_t axes) {
  Expr size = 1.0;
  for (std::size_t a = 0; a < axes; ++a) {
    if (over[a]) size = binary(BinaryOp::multiply, size, metric.scales[a]);
  }
  return size;
}

Expr volume_of(const Metric& metric) {
  return binary(BinaryOp::multiply, size_of(metric, {true, true, true}, metric.scales.size()), metric.around);
}

double mean_of(const Expr& formula, const std::vector<Axis>& axes, const Placement& placement) {
  // a formula that does not depend on an axis is evaluated in one cell along it
  std::vector<Axis> few = axes_at(axes, placement);
  for (std::size_t a = 0; a < few.size(); ++a) {
    if (!depends_on_axis(formula, static_cast<int>(a))) few[a].cells = 1;
  }
  std::vector<std::optional<Expr>> slopes;
  for (const Axis& axis : few)
    slopes.push_back(axis.stretch ? std::optional(slope_of(axis.stretch->map)) : std::nullopt);
  const Cells cells(few);
  double sum = 0, weights = 0;
  for_each_cell(few, [&](const std::array<int, 3>& cell) {
    double weight = 1;
    for (std::size_t a = 0; a < few.size(); ++a) {
      if (slopes[a]) weight *= value_at(*slopes[a], few[a].low + (cell[a] + 0.5) * few[a].spacing());
    }
    weights += weight;
    sum += weight * value_at(formula, cells.place(cell));
  });
  return sum / weights;
}

std::vector<double> cell_volumes(const std::vector<Axis>& axes, const std::optional<Metric>& metric,
                                 const Placement& placement) {
  const std::vector<Axis> placed = axes_at(axes, placement);
  const Cells cells(placed);
  const std::optional<Expr> volume = metric ? std::optional(volume_of(*metric)) : std::nullopt;
  std::vector<double> volumes;
  for_each_cell(placed, [&](const std::array<int, 3>& cell) {
    volumes.push_back(cells.volume(cell) * (volume ? value_at(*volume, cells.place(cell)) : 1));
  });
  return volumes;
}

}  // namespace dpde::model
