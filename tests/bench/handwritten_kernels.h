// SPDX-License-Identifier: Apache-2.0
// More hand-written fused ghost-cell sweeps, as in handwritten.h: periodic axes, halos filled before and after.
#pragma once

#include "dpde/kernel_abi.h"

namespace dpde::handwritten {

/// a_t = Da lap a - a b^2 + F (1 - a), b_t = Db lap b + a b^2 - (F + k) b, Euler; spacing 1.
struct GrayScott {
  double dt, da, db, feed, kill;
};
void gray_scott_step(const dpde_layout& layout, const double* a, const double* b, double* next_a, double* next_b,
                     GrayScott p);

/// next = u + c (14 faces + 3 edges + corners - 128 u)/30; y in tiles of so many rows.
void heat27_step(const dpde_layout& layout, const double* u, double* next, double c, int64_t rows = 64);

/// old = 2 u - old + c2 dt^2 lap u, with differences of order 8; halo 4, spacing 1.
template <class Real>
void wave25_step(const dpde_layout& layout, const Real* u, Real* old, const Real* c2, Real dt, int64_t rows = 32);

/// eta_t = -div((depth + eta) u), u_t = -g grad eta, velocities on the upper faces, Euler; spacing 1.
struct Water {
  const double *u, *v, *eta;
};
struct NextWater {
  double *u, *v, *eta;
};
void water_step(const dpde_layout& layout, Water from, const double* depth, NextWater to, double dt, double g);

}  // namespace dpde::handwritten
