// SPDX-License-Identifier: Apache-2.0
// Reference semantics of a solve: the operator's matrix, one column per cell, and its pseudo-inverse.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "stencil/interpret/interpret.h"
#include "support/assert.h"
#include "support/maths/least_squares.h"

namespace dpde::stencil {

namespace {

std::vector<double> image_of(const Image& image, std::vector<double> values, double factor) {
  for (double& value : values) value *= factor;
  return image(values);
}

/// Numbers between -1 and 1, the same in each run. They are irregular, so that no stencil maps them to 0.
std::vector<double> arbitrary(std::size_t count) {
  std::vector<double> values(count);
  std::uint64_t state = 0x9e3779b97f4a7c15;
  for (double& value : values) {
    state = state * 6364136223846793005 + 1442695040888963407;
    value = static_cast<double>(state >> 11) * 0x1p-52 - 1;
  }
  return values;
}

/// Sets matrix rows to 0 that consist of rounding errors only, as when differences cancel in one cell. Such rows scale
/// exactly when the input is multiplied by a power of two, but not by three or five.
void drop_rounding(const Image& image, DenseMatrix& matrix, std::size_t cells) {
  const std::vector<double> values = cells == 1 ? std::vector<double>{1.0} : arbitrary(cells);
  const std::vector<double> once = image_of(image, values, 1);
  std::vector<bool> is_rounding(cells, false);
  for (const double factor : {3.0, 5.0, 7.0, 11.0, 13.0}) {
    const std::vector<double> made = image_of(image, values, factor);
    for (std::size_t row = 0; row < cells; ++row) {
      const bool is_off = std::abs(made[row] - factor * once[row]) > 1e-3 * std::abs(factor * once[row]);
      is_rounding[row] = is_rounding[row] || is_off;
    }
  }
  for (const double power : {2.0, 4.0, 8.0, 16.0}) {
    const std::vector<double> made = image_of(image, values, power);
    for (std::size_t row = 0; row < cells; ++row) is_rounding[row] = is_rounding[row] && made[row] == power * once[row];
  }
  constexpr double near = 8;  // roundings of neighbouring rows
  double level = 0;
  const auto largest_of = [&](std::size_t row) {
    double most = 0;
    for (std::size_t column = 0; column < cells; ++column) most = std::max(most, std::abs(matrix.column(column)[row]));
    return most;
  };
  for (std::size_t row = 0; row < cells; ++row) level = is_rounding[row] ? std::max(level, largest_of(row)) : level;
  for (std::size_t row = 0; row < cells; ++row) {
    if (!is_rounding[row] && largest_of(row) > near * level) continue;
    for (std::size_t column = 0; column < cells; ++column) matrix.column(column)[row] = 0;
  }
}

PseudoInverse inverse_of(const Image& image, std::size_t cells, Precision real) {
  DenseMatrix matrix(cells);
  std::vector<double> unit(cells, 0.0);
  for (std::size_t column = 0; column < cells; ++column) {
    unit[column] = 1;
    const std::vector<double> of_unit = image(unit);
    require(of_unit.size() == unit.size(), "an image in all cells");
    std::ranges::copy(of_unit, matrix.column(column).begin());
    unit[column] = 0;
  }
  drop_rounding(image, matrix, cells);
  const double rounding = real == Precision::f32 ? 0x1p-23 : 0x1p-52;
  return {std::move(matrix), 64 * rounding * static_cast<double>(cells)};  // entries are rounded, zeros too
}

double norm(const std::vector<double>& x) {
  return std::sqrt(std::transform_reduce(x.begin(), x.end(), x.begin(), 0.0));
}

}  // namespace

class Inverses {
 public:
  std::vector<std::pair<OperatorParts, PseudoInverse>> known;
  std::vector<std::pair<std::pair<OperatorParts, std::vector<double>>, std::vector<double>>> solutions;  // by Newton
};

std::shared_ptr<Inverses> new_inverses() { return std::make_shared<Inverses>(); }

std::vector<double> values_of_all(const State& state, const std::vector<std::string>& fields) {
  std::vector<double> all;
  for (const std::string& field : fields) {
    const std::vector<double> values = state.get(field);
    all.insert(all.end(), values.begin(), values.end());
  }
  return all;
}

void set_all(State& state, const std::vector<std::string>& fields, const std::vector<double>& values) {
  const auto size = static_cast<std::ptrdiff_t>(values.size() / fields.size());
  auto from = values.begin();
  for (const std::string& field : fields) {
    state.set(field, {from, from + size});
    from += size;
  }
}

namespace {

std::vector<double> smallest_solution(const OperatorParts& parts, const Image& image, const std::vector<double>& right,
                                      const State& state) {
  Inverses own;
  auto& known = (state.inverses ? *state.inverses : own).known;
  auto found = std::ranges::find(known, parts, &std::pair<OperatorParts, PseudoInverse>::first);
  if (found == known.end()) {
    known.emplace_back(parts, inverse_of(image, right.size(), state.real()));
    found = std::prev(known.end());
  }
  return found->second.solve(right);
}

/// Newton's method with a Jacobian of difference quotients, whose errors do not change the solution. If there are
/// several solutions it follows the runtime to one of them: steps that increase the residual much are halved, and it
/// fails when steps grow twice.
class Newton {
 public:
  Newton(const Image& image, const std::vector<double>& right, std::size_t fields, const State& state)
      : image_(image),
        right_(right),
        cells_(right.size() / fields),
        state_(state),
        step_(std::sqrt(rounding_of(state.real()))) {}

  std::vector<double> run() {
    std::vector<double> x = right_, best;
    double nearest = std::numeric_limits<double>::infinity();
    int worse = 0, growing = 0;
    std::optional<PseudoInverse> inverse;
    double moved = std::numeric_limits<double>::infinity();
    for (int k = 0; k < most_iterations && worse < 3 && growing < 2; ++k) {
      const std::vector<double> left = residual(x);
      const double distance = norm(left);
      if (!std::isfinite(distance)) break;
      if (!(distance < nearest / 8) || moved > near_enough) inverse.reset();
      worse = distance < nearest || moved > near_enough ? 0 : worse + 1;
      if (distance < nearest) {
        nearest = distance;
        best = x;
      }
      if (distance == 0) break;
      if (!inverse) inverse.emplace(matrix(x, left), 0);
      const std::vector<double> change = inverse->solve(left);
      const double last = std::exchange(moved, relative_size(change, x));
      if (moved > near_enough && moved > last) ++growing;
      x = nearer(x, change, distance);
    }
    const double size = norm(right_) + largest_slope_ * norm(best);
    const bool has_come = !best.empty() && growing < 2 && nearest <= 1e4 * rounding_of(state_.real()) * size;
    return has_come ? best : std::vector<double>(right_.size(), std::nan(""));
  }

 private:
  static constexpr int most_iterations = 60, most_halvings = 8;
  static constexpr double near_enough = 1e-3;  // below this change the Jacobian may be reused
  static double rounding_of(Precision real) { return real == Precision::f32 ? 0x1p-23 : 0x1p-52; }

  std::vector<double> residual(const std::vector<double>& x) const {
    std::vector<double> left = image_(x);
    for (std::size_t i = 0; i < left.size(); ++i) left[i] = right_[i] - left[i];
    return left;
  }

  DenseMatrix matrix(std::vector<double> x, const std::vector<double>& left) {
    DenseMatrix slopes(right_.size());
    largest_slope_ = 0;
    for (std::size_t column = 0; column < x.size(); ++column) {
      double& value = x[column];
      const double middle = value, step = step_ * std::max(std::abs(middle), 1.0);
      value = state_.stored(middle + step);
      const std::vector<double> there = residual(x);
      for (std::size_t row = 0; row < x.size(); ++row) {
        double& slope = slopes.column(column)[row];
        slope = (left[row] - there[row]) / (value - middle);
        largest_slope_ = std::max(largest_slope_, std::abs(slope));
      }
      value = middle;
    }
    return slopes;
  }

  /// The largest relative change of all fields. A field that is 0, as a velocity that masks constrain everywhere,
  /// changes by the rounding errors of the others, which is no size to compare with.
  double relative_size(const std::vector<double>& change, const std::vector<double>& x) const {
    double most = 0, all = 1e-300;
    for (std::size_t i = 0; i < x.size(); ++i) all = std::max({all, std::abs(x[i]), std::abs(right_[i])});
    for (std::size_t first = 0; first < x.size(); first += cells_) {
      double moves = 0, size = step_ * all;
      for (std::size_t i = first; i < first + cells_; ++i) {
        moves = std::max(moves, std::abs(change[i]));
        size = std::max({size, std::abs(x[i]), std::abs(right_[i])});
      }
      most = std::max(most, moves / size);
    }
    return most;
  }

  std::vector<double> nearer(const std::vector<double>& x, const std::vector<double>& change, double distance) const {
    std::vector<double> next = x;
    double part = 1;
    for (int halving = 0; halving <= most_halvings; ++halving, part /= 2) {
      for (std::size_t i = 0; i < x.size(); ++i) next[i] = state_.stored(x[i] + part * change[i]);
      if (norm(residual(next)) <= 2 * distance) break;
    }
    return next;
  }

  const Image& image_;
  const std::vector<double>& right_;
  const std::size_t cells_;
  const State& state_;
  const double step_;
  double largest_slope_ = 0;
};

}  // namespace

std::vector<double> solution(const OperatorParts& parts, const Image& image, const State& state) {
  const std::vector<double> right = values_of_all(state, parts.solve.rights);
  if (parts.solve.is_linear) return smallest_solution(parts, image, right, state);
  Inverses own;
  auto& known = (state.inverses ? *state.inverses : own).solutions;
  const auto found = std::ranges::find_if(
      known, [&](const auto& one) { return one.first.second == right && one.first.first == parts; });
  if (found != known.end()) return found->second;
  return known.emplace_back(std::pair(parts, right), Newton(image, right, parts.solve.unknowns.size(), state).run())
      .second;
}

}  // namespace dpde::stencil
