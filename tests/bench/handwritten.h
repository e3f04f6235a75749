// SPDX-License-Identifier: Apache-2.0
// Hand-written fused ghost-cell sweeps: what generated code is compared with (shared/design/speed.md, section 2).
//
// All work on fields with a dpde_layout (halo >= 1, periodic axes) given by their base pointers, read fields whose
// halos are filled, and leave the halos of what they write filled: the ends of each row right after the row.
#pragma once

#include <cstdint>

#include "dpde/kernel_abi.h"

namespace dpde::handwritten {

/// u_t = -u u_x + nu u_xx, Euler, central differences: a = dt / (2 h), c = nu dt / h^2.
struct Burgers {
  double a, c;
};
void burgers1d_step(const dpde_layout& layout, const double* u, double* next, Burgers p);
/// bar = transpose of the step at u, times seed.
void burgers1d_adjoint(const dpde_layout& layout, const double* u, const double* seed, double* bar, Burgers p);

/// States k = 0 .. steps at trajectory + k * layout.size (pointers to cell 0); state 0 is given.
void burgers1d_forward(const dpde_layout& layout, double* trajectory, int steps, Burgers p);
/// Loss sum (u - target)^2 at the end and its gradient in the initial state; returns the loss. bars: two fields; the
/// gradient ends in the first when `steps` is even.
double burgers1d_gradient(const dpde_layout& layout, double* trajectory, int steps, Burgers p, const double* target,
                          double* const bars[2]);

/// u_t = -u u_x + nu u_xx, diffused and then traced back by dt u/h cells, linear between cells: a = dt/h, c = nu
/// dt/h^2. The mean of u^2 after the steps; its gradient by `start` ends in work[0]. mids: what is traced in step k, at
/// k * stride.
double traced_gradient(int64_t n, const double* start, double* mids, int64_t stride, int steps, Burgers p,
                       double* const work[2]);

/// Two velocities, u_t = -u u_x - v u_y + nu lap u, the same for v; hx = hy.
struct Velocity {
  const double *u, *v;
};
struct NextVelocity {
  double *u, *v;
};
void burgers2d_step(const dpde_layout& layout, Velocity from, NextVelocity to, Burgers p);
/// One RK4 step in place with an array for each stage and separate updates: what fusing stages with updates saves.
void burgers2d_rk4_separate(const dpde_layout& layout, NextVelocity u, NextVelocity stage, const NextVelocity k[4],
                            Burgers p);
void burgers2d_adjoint(const dpde_layout& layout, Velocity at, Velocity seed, NextVelocity bar, Burgers p);

/// next = u + c (sum of 6 neighbours - 6 u); y in tiles of so many rows, with or without prefetch of the next row
/// above.
struct Tiling {
  int64_t rows = 64;
  bool prefetch = false;
};
void heat3d_step(const dpde_layout& layout, const double* u, double* next, double c, Tiling tiling = {});

/// next = w - dt J(phi, w) with Arakawa's bracket J and hx = hy: a = dt / (12 h^2).
void arakawa_step(const dpde_layout& layout, const double* phi, const double* w, double* next, double a);

/// Rooflines: to = from, over all elements.
void copy(double* to, const double* from, int64_t count);
/// to = from + factor * more
void triad(double* to, const double* from, const double* more, double factor, int64_t count);

/// The same kernels as row functions; uniforms are a, c (heat: c).
/// streams: u[-1], u, u[+1], next
void burgers1d_row(const dpde_row* row);
/// streams: u[-1], u, u[+1], seed[-1], seed, seed[+1], bar
void burgers1d_adjoint_row(const dpde_row* row);
/// streams: centre, west, east, south, north of u, then of v, then the next u and v
void burgers2d_row(const dpde_row* row);
/// streams: centre, west, east, south, north of u, v, seed of u, seed of v; then bars of u and v
void burgers2d_adjoint_row(const dpde_row* row);
/// streams: centre, west, east, south, north, below, above, next
void heat3d_row(const dpde_row* row);
/// streams: u, target; sum
void square_row(const dpde_row* row);
/// streams: u, target, bar
void square_adjoint_row(const dpde_row* row);

}  // namespace dpde::handwritten
