// SPDX-License-Identifier: Apache-2.0
// How large unknowns of different kinds are. L-BFGS begins with a multiple of the unit matrix, which is far from any
// Hessian where one unknown is 1e-6 and another 5e4: it takes unknowns divided by these sizes.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dpde/runtime/optimise.h"

namespace dpde {

/// Of `count` unknowns from `first` on. 0: not known before the first gradient is, of which a step of that size then
/// has as much as of the others.
struct UnknownScale {
  Eigen::Index first = 0, count = 0;
  double size = 0;
};
/// By the root mean square of each part's start; of those that begin at 0 by half the width of their bounds. Of a
/// single part there are none: nothing depends on them then.
std::vector<UnknownScale> scales_of(const Eigen::VectorXd& start, std::vector<UnknownScale> parts,
                                    const Bounds& bounds);

/// Of each unknown, at a first gradient; empty where there are no scales.
Eigen::VectorXd scale_of(const std::vector<UnknownScale>& scales, const Eigen::VectorXd& gradient);
/// Makes one iteration from a state whose loss and gradient are those at x, with unknowns over `scale`. False when no
/// step lowers the loss; x is then what it was.
bool iterate(const Lbfgs& method, LbfgsState& state, const Eigen::VectorXd& scale, const Objective& objective,
             const Bounds& bounds = {});

struct ScaledResult {
  OptimiseResult result;
  std::vector<double> scales;  // that the method took, one a part; empty: none
};
/// Other methods than L-BFGS take none.
ScaledResult minimise_scaled(const Method& method, const Objective& objective, const HessianProduct& hessian,
                             Eigen::VectorXd x, int iterations, const std::vector<UnknownScale>& scales,
                             const IterationObserver& observer = {}, const Bounds& bounds = {});
ScaledResult minimise_scaled(const Lbfgs& method, const Objective& objective, Eigen::VectorXd x, int iterations,
                             const std::vector<UnknownScale>& scales, const IterationObserver& observer = {},
                             double gradient_tolerance = 0, const Bounds& bounds = {});

}  // namespace dpde
