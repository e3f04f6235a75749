// SPDX-License-Identifier: Apache-2.0
// How far rounding alone sets two ways to one number apart. A derivative that is 0 because its terms cancel, as that of
// sum(u*dx(u)) does on every periodic grid, is computed as rounding by the tangent and by the adjoint: they have no
// digit in common, and no size of their own terms tells so. Moving the inputs by roundings does: what rounding makes
// changes at random, what a wrong derivative makes stays.
#pragma once

#include <functional>
#include <random>
#include <span>

namespace dpde::adjoint {

/// A directional derivative by the tangent and by the adjoint.
struct TwoWays {
  double forward = 0, backward = 0;
};

/// Each value times 1, 1 +- epsilon or 1 +- 2 epsilon.
void nudge(std::span<double> values, double epsilon, std::mt19937_64& random);

/// Of values, in units of their epsilon: as much as rounding amounts to in the terms of differences of high order.
constexpr double most_roundings = 1e7;

/// Some times the spread of both and of their difference over some calls of `nudged`, each from inputs moved by the
/// roundings that it is given. The difference is also taken from inputs moved farther: a rounding of k does not move 1
/// + 0.1*k, and the two ways themselves may move as far as they like. 0 where the spread is more than `most`: a choice
/// has changed between the calls, which is not rounding.
double rounding_between(const std::function<TwoWays(double epsilon)>& nudged, double epsilon, double most);

}  // namespace dpde::adjoint
