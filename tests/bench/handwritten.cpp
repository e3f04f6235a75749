// SPDX-License-Identifier: Apache-2.0
// Rows are functions with restrict parameters: neither compiler sees inside a longer function that they do not alias.
#include "handwritten.h"

#include <algorithm>

namespace dpde::handwritten {
namespace {

[[gnu::noinline]] void burgers1d(int64_t count, const double* __restrict w, const double* __restrict u,
                                 const double* __restrict e, double* __restrict next, double a, double c) {
  for (int64_t i = 0; i < count; ++i) next[i] = u[i] - a * u[i] * (e[i] - w[i]) + c * (e[i] - 2 * u[i] + w[i]);
}

[[gnu::noinline]] void burgers1d_reverse(int64_t count, const double* __restrict u, const double* __restrict s,
                                         double* __restrict bar, double a, double c) {
  for (int64_t i = 0; i < count; ++i) {
    bar[i] =
        s[i] * (1 - 2 * c - a * (u[i + 1] - u[i - 1])) + s[i - 1] * (c - a * u[i - 1]) + s[i + 1] * (c + a * u[i + 1]);
  }
}

/// In eight parts, so that it may use vectors.
[[gnu::noinline]] double square_sum(int64_t count, const double* __restrict u, const double* __restrict target) {
  double loss[8] = {};
  int64_t i = 0;
  for (; i + 8 <= count; i += 8) {
    for (int64_t k = 0; k < 8; ++k) loss[k] += (u[i + k] - target[i + k]) * (u[i + k] - target[i + k]);
  }
  for (; i < count; ++i) loss[0] += (u[i] - target[i]) * (u[i] - target[i]);
  return ((loss[0] + loss[1]) + (loss[2] + loss[3])) + ((loss[4] + loss[5]) + (loss[6] + loss[7]));
}

[[gnu::noinline]] void square_reverse(int64_t count, const double* __restrict u, const double* __restrict target,
                                      double* __restrict bar, double factor) {
  for (int64_t i = 0; i < count; ++i) bar[i] = factor * (u[i] - target[i]);
}

[[gnu::noinline]] void burgers2d(int64_t count, const double* __restrict u, const double* __restrict us,
                                 const double* __restrict un, const double* __restrict v, const double* __restrict vs,
                                 const double* __restrict vn, double* __restrict next_u, double* __restrict next_v,
                                 double a, double c, double one = 1) {
  const double centre = one - 4 * c;
  for (int64_t i = 0; i < count; ++i) {
    const double west = c + a * u[i], east = c - a * u[i], south = c + a * v[i], north = c - a * v[i];
    next_u[i] = centre * u[i] + west * u[i - 1] + east * u[i + 1] + south * us[i] + north * un[i];
    next_v[i] = centre * v[i] + west * v[i - 1] + east * v[i + 1] + south * vs[i] + north * vn[i];
  }
}

struct Rows {  // a row and those south and north of it
  const double *c, *s, *n;
};

[[gnu::noinline]] void burgers2d_reverse(int64_t count, const double* __restrict u, const double* __restrict us,
                                         const double* __restrict un, const double* __restrict v,
                                         const double* __restrict vs, const double* __restrict vn, Rows p, Rows q,
                                         double* __restrict bar_u, double* __restrict bar_v, double a, double c) {
  const double* __restrict pc = p.c, * __restrict ps = p.s, * __restrict pn = p.n;
  const double* __restrict qc = q.c, * __restrict qs = q.s, * __restrict qn = q.n;
  const double centre = 1 - 4 * c;
  for (int64_t i = 0; i < count; ++i) {
    const double from_west = c - a * u[i - 1], from_east = c + a * u[i + 1], from_south = c - a * vs[i],
                 from_north = c + a * vn[i];
    const double ux = a * (u[i + 1] - u[i - 1]), vx = a * (v[i + 1] - v[i - 1]), uy = a * (un[i] - us[i]),
                 vy = a * (vn[i] - vs[i]);
    bar_u[i] = centre * pc[i] - ux * pc[i] - vx * qc[i] + from_west * pc[i - 1] + from_east * pc[i + 1] +
               from_south * ps[i] + from_north * pn[i];
    bar_v[i] = centre * qc[i] - uy * pc[i] - vy * qc[i] + from_west * qc[i - 1] + from_east * qc[i + 1] +
               from_south * qs[i] + from_north * qn[i];
  }
}

[[gnu::noinline]] void heat3d(int64_t count, const double* __restrict u, const double* __restrict s,
                              const double* __restrict n, const double* __restrict below,
                              const double* __restrict above, double* __restrict next, double c) {
  const double centre = 1 - 6 * c;
  for (int64_t i = 0; i < count; ++i)
    next[i] = centre * u[i] + c * (((u[i - 1] + u[i + 1]) + (s[i] + n[i])) + (below[i] + above[i]));
}

inline void fill_ends(double* row, int64_t n) {
  row[-1] = row[n - 1];
  row[n] = row[0];
}

/// After row y of a plane of ny rows is complete with its ends: the ghost rows that are copies of it.
inline void copy_to_ghost_row(double* plane, int64_t y, const dpde_layout& layout) {
  const int64_t n = layout.cells[0], ny = layout.cells[1], stride = layout.stride[1];
  const auto copy_row = [&](int64_t to) { std::copy_n(plane + y * stride - 1, n + 2, plane + to * stride - 1); };
  if (y == 0) copy_row(ny);
  if (y == ny - 1) copy_row(-1);
}

}  // namespace

void burgers1d_step(const dpde_layout& layout, const double* u, double* next, Burgers p) {
  burgers1d(layout.cells[0], u - 1, u, u + 1, next, p.a, p.c);
  fill_ends(next, layout.cells[0]);
}

void burgers1d_adjoint(const dpde_layout& layout, const double* u, const double* seed, double* bar, Burgers p) {
  burgers1d_reverse(layout.cells[0], u, seed, bar, p.a, p.c);
  fill_ends(bar, layout.cells[0]);
}

void burgers1d_forward(const dpde_layout& layout, double* trajectory, int steps, Burgers p) {
  for (int k = 0; k < steps; ++k)
    burgers1d_step(layout, trajectory + k * layout.size, trajectory + (k + 1) * layout.size, p);
}

double burgers1d_gradient(const dpde_layout& layout, double* trajectory, int steps, Burgers p, const double* target,
                          double* const bars[2]) {
  burgers1d_forward(layout, trajectory, steps, p);
  const double* last = trajectory + steps * layout.size;
  const double loss = square_sum(layout.cells[0], last, target);
  square_reverse(layout.cells[0], last, target, bars[0], 2);
  fill_ends(bars[0], layout.cells[0]);
  int bar = 0;
  for (int k = steps - 1; k >= 0; --k, bar = 1 - bar)
    burgers1d_adjoint(layout, trajectory + k * layout.size, bars[bar], bars[1 - bar], p);
  return loss;
}

void burgers2d_step(const dpde_layout& layout, Velocity from, NextVelocity to, Burgers p) {
  const int64_t n = layout.cells[0], stride = layout.stride[1];
  for (int64_t y = 0; y < layout.cells[1]; ++y) {
    const double *u = from.u + y * stride, *v = from.v + y * stride;
    double *next_u = to.u + y * stride, *next_v = to.v + y * stride;
    burgers2d(n, u, u - stride, u + stride, v, v - stride, v + stride, next_u, next_v, p.a, p.c);
    fill_ends(next_u, n);
    fill_ends(next_v, n);
    copy_to_ghost_row(to.u, y, layout);
    copy_to_ghost_row(to.v, y, layout);
  }
}

/// dt F(u): what a step adds.
void burgers2d_rate(const dpde_layout& layout, Velocity from, NextVelocity to, Burgers p) {
  const int64_t n = layout.cells[0], stride = layout.stride[1];
  for (int64_t y = 0; y < layout.cells[1]; ++y) {
    const double *u = from.u + y * stride, *v = from.v + y * stride;
    burgers2d(n, u, u - stride, u + stride, v, v - stride, v + stride, to.u + y * stride, to.v + y * stride, p.a, p.c,
              0);
  }
}

/// to = from + factor k, halo filled
void add_stage(const dpde_layout& layout, const double* from, const double* k, double factor, double* to) {
  const int64_t n = layout.cells[0], stride = layout.stride[1];
  for (int64_t y = 0; y < layout.cells[1]; ++y) {
    triad(to + y * stride, from + y * stride, k + y * stride, factor, n);
    fill_ends(to + y * stride, n);
    copy_to_ghost_row(to, y, layout);
  }
}

[[gnu::noinline]] void weigh_row(int64_t count, double* __restrict u, const double* __restrict k1,
                                 const double* __restrict k2, const double* __restrict k3,
                                 const double* __restrict k4) {
  for (int64_t i = 0; i < count; ++i) u[i] += (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]) / 6;
}

void burgers2d_rk4_separate(const dpde_layout& layout, NextVelocity u, NextVelocity stage, const NextVelocity k[4],
                            Burgers p) {
  const int64_t n = layout.cells[0], stride = layout.stride[1];
  const double factors[3] = {0.5, 0.5, 1};
  burgers2d_rate(layout, {u.u, u.v}, k[0], p);
  for (int s = 0; s < 3; ++s) {
    add_stage(layout, u.u, k[s].u, factors[s], stage.u);
    add_stage(layout, u.v, k[s].v, factors[s], stage.v);
    burgers2d_rate(layout, {stage.u, stage.v}, k[s + 1], p);
  }
  for (int64_t y = 0; y < layout.cells[1]; ++y) {
    const int64_t row = y * stride;
    weigh_row(n, u.u + row, k[0].u + row, k[1].u + row, k[2].u + row, k[3].u + row);
    weigh_row(n, u.v + row, k[0].v + row, k[1].v + row, k[2].v + row, k[3].v + row);
    for (double* field : {u.u, u.v}) {
      fill_ends(field + row, n);
      copy_to_ghost_row(field, y, layout);
    }
  }
}

void burgers2d_adjoint(const dpde_layout& layout, Velocity at, Velocity seed, NextVelocity bar, Burgers p) {
  const int64_t n = layout.cells[0], stride = layout.stride[1];
  const auto rows = [&](const double* field, int64_t y) {
    return Rows{field + y * stride, field + (y - 1) * stride, field + (y + 1) * stride};
  };
  for (int64_t y = 0; y < layout.cells[1]; ++y) {
    const Rows u = rows(at.u, y), v = rows(at.v, y);
    double *bar_u = bar.u + y * stride, *bar_v = bar.v + y * stride;
    burgers2d_reverse(n, u.c, u.s, u.n, v.c, v.s, v.n, rows(seed.u, y), rows(seed.v, y), bar_u, bar_v, p.a, p.c);
    fill_ends(bar_u, n);
    fill_ends(bar_v, n);
    copy_to_ghost_row(bar.u, y, layout);
    copy_to_ghost_row(bar.v, y, layout);
  }
}

void heat3d_step(const dpde_layout& layout, const double* u, double* next, double c, Tiling tiling) {
  const int64_t n = layout.cells[0], sy = layout.stride[1], sz = layout.stride[2];
  for (int64_t from = 0; from < layout.cells[1]; from += tiling.rows) {
    const int64_t to = std::min(from + tiling.rows, layout.cells[1]);
    for (int64_t z = 0; z < layout.cells[2]; ++z) {
      for (int64_t y = from; y < to; ++y) {
        const double* row = u + z * sz + y * sy;
        double* out = next + z * sz + y * sy;
        for (int64_t x = 0; tiling.prefetch && x < n; x += 8) __builtin_prefetch(row + sz + sy + x);
        heat3d(n, row, row - sy, row + sy, row - sz, row + sz, out, c);
        fill_ends(out, n);
        copy_to_ghost_row(next + z * sz, y, layout);
      }
    }
  }
  const int64_t plane = (layout.cells[1] + 2) * sy, first = -sy - 1;
  std::copy_n(next + (layout.cells[2] - 1) * sz + first, plane, next - sz + first);
  std::copy_n(next + first, plane, next + layout.cells[2] * sz + first);
}

/// Not memcpy: that would pick other stores for large arrays.
[[gnu::optimize("no-tree-loop-distribute-patterns")]] void copy(double* __restrict to, const double* __restrict from,
                                                                int64_t count) {
  for (int64_t i = 0; i < count; ++i) to[i] = from[i];
}

void triad(double* __restrict to, const double* __restrict from, const double* __restrict more, double factor,
           int64_t count) {
  for (int64_t i = 0; i < count; ++i) to[i] = from[i] + factor * more[i];
}

struct Streams {
  void* const* pointers;
  double* operator[](int k) const { return static_cast<double*>(pointers[k]); }
};

void burgers1d_row(const dpde_row* row) {
  const Streams s{row->streams};
  burgers1d(row->count, s[0], s[1], s[2], s[3], row->uniforms[0], row->uniforms[1]);
}
void burgers1d_adjoint_row(const dpde_row* row) {
  const Streams s{row->streams};
  burgers1d_reverse(row->count, s[1], s[4], s[6], row->uniforms[0], row->uniforms[1]);
}
void burgers2d_row(const dpde_row* row) {
  const Streams s{row->streams};
  burgers2d(row->count, s[0], s[3], s[4], s[5], s[8], s[9], s[10], s[11], row->uniforms[0], row->uniforms[1]);
}
void burgers2d_adjoint_row(const dpde_row* row) {
  const Streams s{row->streams};
  burgers2d_reverse(row->count, s[0], s[3], s[4], s[5], s[8], s[9], {s[10], s[13], s[14]}, {s[15], s[18], s[19]}, s[20],
                    s[21], row->uniforms[0], row->uniforms[1]);
}
void heat3d_row(const dpde_row* row) {
  const Streams s{row->streams};
  heat3d(row->count, s[0], s[3], s[4], s[5], s[6], s[7], row->uniforms[0]);
}
void square_row(const dpde_row* row) {
  row->sums[0] += square_sum(row->count, Streams{row->streams}[0], Streams{row->streams}[1]);
}
void square_adjoint_row(const dpde_row* row) {
  const Streams s{row->streams};
  square_reverse(row->count, s[0], s[1], s[2], 2 * row->uniforms[0]);
}

}  // namespace dpde::handwritten
