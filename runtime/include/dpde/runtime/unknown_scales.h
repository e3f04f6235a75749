// SPDX-License-Identifier: Apache-2.0
// Typical sizes of unknowns of different kinds. L-BFGS starts from a multiple of the unit matrix, far from any Hessian
// if one unknown is 1e-6 and another 5e4: it works with unknowns divided by these sizes.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dpde/runtime/optimise.h"

namespace dpde {

/// Size of the unknowns first .. first + count - 1. 0: set by the first gradient, such that a step of this size changes
/// the loss as much as for the other unknowns.
struct UnknownScale {
  Eigen::Index first = 0, count = 0;
  double size = 0;
};
/// Size of each part: the root mean square of its start; if that is 0, half the width of its bounds. Empty for a single
/// part: its scale has no effect.
std::vector<UnknownScale> scales_of(const Eigen::VectorXd& start, std::vector<UnknownScale> parts,
                                    const Bounds& bounds);

/// The scale of each unknown, at the first gradient; empty if there are no scales.
Eigen::VectorXd scale_of(const std::vector<UnknownScale>& scales, const Eigen::VectorXd& gradient);
/// Makes one iteration in the unknowns divided by `scale`, from a state whose loss and gradient belong to x. Returns
/// false and restores x if no step lowers the loss.
bool iterate(const Lbfgs& method, LbfgsState& state, const Eigen::VectorXd& scale, const Objective& objective,
             const Bounds& bounds = {});

struct ScaledResult {
  OptimiseResult result;
  std::vector<double> scales;  // scales used, one for each part; empty: none
};
/// Methods other than L-BFGS use no scales.
ScaledResult minimise_scaled(const Method& method, const Objective& objective, const HessianProduct& hessian,
                             Eigen::VectorXd x, int iterations, const std::vector<UnknownScale>& scales,
                             const IterationObserver& observer = {}, const Bounds& bounds = {});
ScaledResult minimise_scaled(const Lbfgs& method, const Objective& objective, Eigen::VectorXd x, int iterations,
                             const std::vector<UnknownScale>& scales, const IterationObserver& observer = {},
                             double gradient_tolerance = 0, const Bounds& bounds = {});

}  // namespace dpde
