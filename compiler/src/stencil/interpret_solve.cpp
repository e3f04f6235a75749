// SPDX-License-Identifier: Apache-2.0
// The meaning of a solve: the matrix of the operator, a column for each cell, and its pseudo-inverse.
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "stencil/interpret.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

using Inverse = Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>;

Inverse inverse_of(const Image& image, Eigen::Index cells, Precision real) {
  Eigen::MatrixXd matrix(cells, cells);
  std::vector<double> unit(static_cast<std::size_t>(cells), 0.0);
  for (Eigen::Index column = 0; column < cells; ++column) {
    unit[static_cast<std::size_t>(column)] = 1;
    const std::vector<double> of_unit = image(unit);
    require(of_unit.size() == unit.size(), "an image in all cells");
    matrix.col(column) = Eigen::Map<const Eigen::VectorXd>(of_unit.data(), cells);
    unit[static_cast<std::size_t>(column)] = 0;
  }
  // Of differences in one cell nothing is left, but for what rounding leaves: that is not proportional to the values.
  for (const double value : {3.0, 5.0, 7.0, 11.0, 13.0}) {
    if (cells == 1 && std::abs(image({value}).front() - value * matrix(0, 0)) > 1e-3 * std::abs(value * matrix(0, 0)))
      matrix(0, 0) = 0;
  }
  const double rounding = real == Precision::f32 ? 0x1p-23 : 0x1p-52;
  Inverse inverse;
  inverse.setThreshold(64 * rounding * static_cast<double>(cells));  // entries are rounded: 0 is not quite 0
  inverse.compute(matrix);
  return inverse;
}

}  // namespace

class Inverses {
 public:
  std::vector<std::pair<OperatorParts, Inverse>> known;
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
  const auto cells = static_cast<Eigen::Index>(right.size());
  auto found = std::ranges::find(known, parts, &std::pair<OperatorParts, Inverse>::first);
  if (found == known.end()) {
    known.emplace_back(parts, inverse_of(image, cells, state.real()));
    found = std::prev(known.end());
  }
  const Eigen::VectorXd x = found->second.solve(Eigen::Map<const Eigen::VectorXd>(right.data(), cells));
  return {x.data(), x.data() + cells};
}

/// Newton's method with its matrix by differences: what it comes to does not hang on that matrix. Where there are
/// several solutions it takes the way of the runtime to one of them: steps that make what is left grow much are halved,
/// and where steps grow twice it is given up.
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
    std::optional<Eigen::PartialPivLU<Eigen::MatrixXd>> factors;
    double moved = std::numeric_limits<double>::infinity();
    for (int k = 0; k < most_iterations && worse < 3 && growing < 2; ++k) {
      const Eigen::VectorXd left = residual(x);
      const double distance = left.norm();
      if (!std::isfinite(distance)) break;
      if (!(distance < nearest / 8) || moved > near_enough) factors.reset();
      worse = distance < nearest || moved > near_enough ? 0 : worse + 1;
      if (distance < nearest) {
        nearest = distance;
        best = x;
      }
      if (distance == 0) break;
      if (!factors) factors.emplace(matrix(x, left));
      const Eigen::VectorXd change = factors->solve(left);
      const double last = std::exchange(moved, relative_size(change, x));
      if (moved > near_enough && moved > last) ++growing;
      x = nearer(x, change, distance);
    }
    const double size = Eigen::Map<const Eigen::VectorXd>(right_.data(), count()).norm();
    const bool has_come =
        !best.empty() && growing < 2 && nearest <= 1e4 * rounding_of(state_.real()) * (size + scale_of(best));
    return has_come ? best : std::vector<double>(right_.size(), std::nan(""));
  }

 private:
  static constexpr int most_iterations = 60, most_halvings = 8;
  static constexpr double near_enough = 1e-3;  // a change after which the same matrix may serve
  static double rounding_of(Precision real) { return real == Precision::f32 ? 0x1p-23 : 0x1p-52; }
  Eigen::Index count() const { return static_cast<Eigen::Index>(right_.size()); }

  Eigen::VectorXd residual(const std::vector<double>& x) const {
    const std::vector<double> made = image_(x);
    return Eigen::Map<const Eigen::VectorXd>(right_.data(), count()) -
           Eigen::Map<const Eigen::VectorXd>(made.data(), count());
  }

  Eigen::MatrixXd matrix(std::vector<double> x, const Eigen::VectorXd& left) {
    Eigen::MatrixXd slopes(count(), count());
    for (Eigen::Index column = 0; column < count(); ++column) {
      double& value = x[static_cast<std::size_t>(column)];
      const double middle = value, step = step_ * std::max(std::abs(middle), 1.0);
      value = state_.stored(middle + step);
      slopes.col(column) = (left - residual(x)) / (value - middle);
      value = middle;
    }
    largest_slope_ = slopes.cwiseAbs().maxCoeff();
    return slopes;
  }

  double scale_of(const std::vector<double>& x) const {
    return largest_slope_ * Eigen::Map<const Eigen::VectorXd>(x.data(), count()).norm();
  }

  /// The largest of the fields.
  double relative_size(const Eigen::VectorXd& change, const std::vector<double>& x) const {
    double most = 0;
    for (std::size_t first = 0; first < x.size(); first += cells_) {
      double moves = 0, size = 1e-300;
      for (std::size_t i = first; i < first + cells_; ++i) {
        moves = std::max(moves, std::abs(change[static_cast<Eigen::Index>(i)]));
        size = std::max({size, std::abs(x[i]), std::abs(right_[i])});
      }
      most = std::max(most, moves / size);
    }
    return most;
  }

  std::vector<double> nearer(const std::vector<double>& x, const Eigen::VectorXd& change, double distance) const {
    std::vector<double> next = x;
    double part = 1;
    for (int halving = 0; halving <= most_halvings; ++halving, part /= 2) {
      for (std::size_t i = 0; i < x.size(); ++i)
        next[i] = state_.stored(x[i] + part * change[static_cast<Eigen::Index>(i)]);
      if (residual(next).norm() <= 2 * distance) break;
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
