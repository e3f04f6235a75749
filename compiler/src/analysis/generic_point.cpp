// SPDX-License-Identifier: Apache-2.0
#include "analysis/generic_point.h"

#include <cmath>

namespace dpde::analysis {

namespace {

double largest(const Eigen::VectorXd& values) { return values.size() == 0 ? 0 : values.cwiseAbs().maxCoeff(); }

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
    for (Eigen::Index i = 0; i < part.size; ++i) {
      // Of a network each weight by its own: a last layer that begins small keeps the run stable.
      const double scale = part.is_network() ? std::abs(x[i]) + 1e-3 * scale_of_all : scale_of_all;
      x[i] += 0.02 * scale * normal(random);
      d[i] = scale * normal(random);
    }
    // Of the parameters of a scene without a task, those without a derivative (of boundary values) stay as they are.
    // What a task seeks moves, whatever is known of its derivative.
    const bool is_sought =
        !session.compiled().options.certify || session.compiled().activity.params.contains(part.name);
    if (!part.is_field() && !is_sought) d.setZero();
  }
  return point;
}

}  // namespace dpde::analysis
