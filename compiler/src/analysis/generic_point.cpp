// SPDX-License-Identifier: Apache-2.0
#include "analysis/generic_point.h"

#include <algorithm>
#include <cmath>

namespace dpde::analysis {

namespace {

double largest(const Eigen::VectorXd& values) { return values.size() == 0 ? 0 : values.cwiseAbs().maxCoeff(); }

/// Keeps the sign of fields with one sign, as a depth or conductivity: another sign might make an operator singular.
double moved(double value, double by, double sign) {
  if (sign == 0) return value + by;
  return value == 0 ? sign * std::abs(by) : value * std::exp(std::clamp(by / value, -0.5, 0.5));
}

/// Common sign of all nonzero values; 0 if they differ.
double sign_of(const Eigen::VectorXd& values) {
  if ((values.array() >= 0).all()) return 1;
  return (values.array() <= 0).all() ? -1 : 0;
}

}  // namespace

Point generic_point(driver::Session& session, const driver::Inverse& inverse, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Point point{inverse.start(), Eigen::VectorXd::Zero(inverse.size())};
  for (const driver::Inverse::Part& part : inverse.parts()) {
    auto x = point.x.segment(part.offset, part.size);
    auto d = point.direction.segment(part.offset, part.size);
    if (part.is_field()) {
      const std::vector<double>& own = inverse.own(part);
      x = Eigen::Map<const Eigen::VectorXd>(own.data(), part.size);
    }
    const double magnitude = largest(x);
    const double scale_of_all = magnitude > 0 ? magnitude : 1;
    const double sign = part.is_field() && magnitude > 0 ? sign_of(x) : 0;
    for (Eigen::Index i = 0; i < part.size; ++i) {
      // Network weights are scaled each by its own size: a small initial last layer keeps the run stable.
      const double scale = part.is_network() ? std::abs(x[i]) + 1e-3 * scale_of_all : scale_of_all;
      x[i] = moved(x[i], 0.02 * scale * normal(random), sign);
      d[i] = scale * normal(random);
    }
    // In a scene without a task, parameters without a derivative (in boundary values) are not moved. Unknowns of a task
    // are always moved.
    const bool is_sought =
        !session.compiled().options.certify || session.compiled().activity.params.contains(part.name);
    if (!part.is_field() && !is_sought) d.setZero();
  }
  inverse.bounds().project(point.x);
  return point;
}

}  // namespace dpde::analysis
