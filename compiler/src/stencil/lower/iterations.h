// SPDX-License-Identifier: Apache-2.0
// Conjugate gradients as statements, so that derivatives go through each of their iterations: what a guess is trained
// by that is to save iterations. Solves to a tolerance are never differentiated so: see adjoint/solves.h.
//
//   b, g without their means where A takes constants to 0;  x = 0;  r = b;  p = g
//   repeat k in 0 .. count + 1 {
//     q = A*p;  a = (r, r)/(p, q), in pass 0: 1;  x += a*p;  r -= a*q;  p = r + (r, r)/(r_old, r_old)*p, in pass 0: r
//   }
//
// Pass 0 makes x = g and r = b - A*g by the same block. Where |r| is below the rounding of |b|^2 + |b - A*g|^2 a and
// the factor of p are 0: what is found has as many digits as it can have, and quotients of what rounding leaves would
// be any numbers. There the derivative is that of what was found.
//
// With a preconditioner M the directions are made of z = M(r) in place of r, by flexible conjugate gradients, as M need
// be neither linear nor symmetric (Y. Notay, SIAM J. Sci. Comput. 22, 2000, 1444):
//
//   a = (r, p)/(p, q);  x += a*p;  r -= a*q;  z = s*N(r/s), s = sqrt((r, r)/cells);  p = z - (z, q)/(p, q)*p
//
// s makes M know nothing of units. What z is times does not matter, its sign included. Where z has no more of r than
// rounding leaves, or is no number, z = r.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// Fields: what is found, what it leaves of the right side, the direction of the next step, which the block reads as
/// its unknown, and sums, the same everywhere.
struct IterationFields {
  int count = 0;
  LoopCarried x, left, direction, square, size;
  std::string squares, squares_at_start, product, curvature, mean, mean_of_start, pass;
  // With a preconditioner: z; products of r and p, z and r, z and z, z and q, r and q; and their sums.
  std::string towards, mean_of_made, ahead, ahead_sum, gains, gain, lengths, length, turns, turned, drifts, drift;

  /// Each with what it is called beside the unknown; but for the unknown itself.
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

/// Appends the iterations, whose unknown is the direction in which they go; their kernels are called `name`_...
void add_iterations(const Solve& solve, const IterationFields& fields, const std::string& start, Precision real,
                    const std::string& name, Module& module, Program& program);

}  // namespace dpde::stencil
