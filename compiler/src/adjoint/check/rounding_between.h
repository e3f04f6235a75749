// SPDX-License-Identifier: Apache-2.0
// The difference between two computations of the same number that rounding alone can cause. A derivative may be 0
// because its terms cancel, such as that of sum(u*dx(u)) on every periodic grid. Tangent and adjoint then give rounding
// errors without a common digit, and the magnitude of their terms does not show it. Perturbing the inputs by rounding
// errors does: differences by rounding change at random, those by a wrong derivative stay.
#pragma once

#include <functional>
#include <random>
#include <span>

namespace dpde::adjoint {

/// A directional derivative, by the tangent and by the adjoint.
struct TwoWays {
  double forward = 0, backward = 0;
};

/// Multiplies each value by 1, 1 +- epsilon or 1 +- 2 epsilon, at random.
void nudge(std::span<double> values, double epsilon, std::mt19937_64& random);

/// Largest plausible rounding error, in units of epsilon: that of the terms of high-order differences.
constexpr double most_roundings = 1e7;

/// A multiple of the spread of both numbers and of their difference over several calls of `nudged`, each with inputs
/// perturbed by its argument. For the difference, inputs are also perturbed more: a rounding error of k does not change
/// 1 + 0.1*k. Both numbers themselves may then change by any amount. Returns 0 if the spread exceeds `most`: a decision
/// has changed between the calls, which is not rounding.
double rounding_between(const std::function<TwoWays(double epsilon)>& nudged, double epsilon, double most);

}  // namespace dpde::adjoint
