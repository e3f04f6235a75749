// SPDX-License-Identifier: Apache-2.0
// Conjugate gradients as statements, so that derivatives go through each iteration: needed to train initial guesses
// that save iterations. Solves to a tolerance are differentiated otherwise: see adjoint/solves.h.
//
//   b, g without their means if A maps constants to 0;  x = 0;  r = b;  p = g
//   repeat k in 0 .. count + 1 {
//     q = A*p;  a = (r, r)/(p, q), in pass 0: 1;  x += a*p;  r -= a*q;  p = r + (r, r)/(r_old, r_old)*p, in pass 0: r
//   }
//
// Pass 0 computes x = g and r = b - A*g by the same block. Once |r|^2 is below the rounding of |b|^2 + |b - A*g|^2, a
// and the factor of p are 0: x is as accurate as possible, and quotients of rounding errors would be arbitrary. The
// derivative is then that of the x found so far.
//
// With a preconditioner M the directions use z = M(r) instead of r, by flexible conjugate gradients, as M need be
// neither linear nor symmetric (Y. Notay, SIAM J. Sci. Comput. 22, 2000, 1444):
//
//   a = (r, p)/(p, q);  x += a*p;  r -= a*q;  z = s*N(r/s), s = sqrt((r, r)/cells);  p = z - (z, q)/(p, q)*p
//
// s makes M independent of units. A factor of z does not matter, nor its sign. If (z, r) is within rounding of 0, or z
// is NaN, z = r.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// Fields of the iteration: the solution, the residual, the direction of the next step, which the block reads as its
/// unknown, and sums, which are uniform.
struct IterationFields {
  int count = 0;
  LoopCarried x, left, direction, square, size;
  std::string squares, squares_at_start, product, curvature, mean, mean_of_start, pass;
  // With a preconditioner: z; products of r and p, z and r, z and z, z and q, r and q; and their sums.
  std::string towards, mean_of_made, ahead, ahead_sum, gains, gain, lengths, length, turns, turned, drifts, drift;

  /// All fields but the unknown, each with its suffix to the name of the unknown.
  std::vector<std::pair<const char*, std::string*>> all() {
    return {{"found", &x.result},
            {"x", &x.state},
            {"x_next", &x.next},
            {"left", &left.state},
            {"left_next", &left.next},
            {"left_last", &left.result},
            {"direction_next", &direction.next},
            {"direction_last", &direction.result},
            {"square", &square.state},
            {"square_next", &square.next},
            {"square_last", &square.result},
            {"size", &size.state},
            {"size_next", &size.next},
            {"size_last", &size.result},
            {"squares", &squares},
            {"squares_at_start", &squares_at_start},
            {"product", &product},
            {"curvature", &curvature},
            {"mean", &mean},
            {"mean_of_start", &mean_of_start},
            {"pass", &pass},
            {"search", &towards},
            {"search_mean", &mean_of_made},
            {"ahead", &ahead},
            {"ahead_sum", &ahead_sum},
            {"gains", &gains},
            {"gain", &gain},
            {"lengths", &lengths},
            {"length", &length},
            {"turns", &turns},
            {"turned", &turned},
            {"drifts", &drifts},
            {"drift", &drift}};
  }
};

/// Appends the iterations; the unknown of their block is the search direction. Kernels are called `name`_...
void add_iterations(const Solve& solve, const IterationFields& fields, const std::string& start, Precision real,
                    const std::string& name, Module& module, Program& program);

}  // namespace dpde::stencil
