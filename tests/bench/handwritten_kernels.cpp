// SPDX-License-Identifier: Apache-2.0
#include "handwritten_kernels.h"

#include <algorithm>

namespace dpde::handwritten {
namespace {

[[gnu::noinline]] void gray_scott(int64_t count, const double* __restrict a, const double* __restrict as,
                                  const double* __restrict an, const double* __restrict b, const double* __restrict bs,
                                  const double* __restrict bn, double* __restrict next_a, double* __restrict next_b,
                                  double da, double db, double dt, double f, double centre_a, double centre_b) {
  for (int64_t i = 0; i < count; ++i) {
    const double reaction = dt * (a[i] * (b[i] * b[i]));
    next_a[i] = centre_a * a[i] + da * ((a[i - 1] + a[i + 1]) + (as[i] + an[i])) - reaction + f;
    next_b[i] = centre_b * b[i] + db * ((b[i - 1] + b[i + 1]) + (bs[i] + bn[i])) + reaction;
  }
}

struct Plane {  // a row and those south and north of it
  const double *c, *s, *n;
};

[[gnu::noinline]] void heat27(int64_t count, Plane below, Plane here, Plane above, double* __restrict next,
                              double centre, double face, double edge, double corner) {
  const double* __restrict bc = below.c, * __restrict bs = below.s, * __restrict bn = below.n;
  const double* __restrict hc = here.c, * __restrict hs = here.s, * __restrict hn = here.n;
  const double* __restrict ac = above.c, * __restrict as = above.s, * __restrict an = above.n;
  for (int64_t i = 0; i < count; ++i) {
    const double faces = ((hc[i - 1] + hc[i + 1]) + (hs[i] + hn[i])) + (bc[i] + ac[i]);
    const double edges =
        (((hs[i - 1] + hs[i + 1]) + (hn[i - 1] + hn[i + 1])) + ((bc[i - 1] + bc[i + 1]) + (ac[i - 1] + ac[i + 1]))) +
        ((bs[i] + bn[i]) + (as[i] + an[i]));
    const double corners =
        ((bs[i - 1] + bs[i + 1]) + (bn[i - 1] + bn[i + 1])) + ((as[i - 1] + as[i + 1]) + (an[i - 1] + an[i + 1]));
    next[i] = centre * hc[i] + face * faces + edge * edges + corner * corners;
  }
}

constexpr double w0 = -205.0 / 72, w1 = 8.0 / 5, w2 = -1.0 / 5, w3 = 8.0 / 315, w4 = -1.0 / 560;

template <class Real>
[[gnu::noinline]] void wave25(int64_t count, const Real* __restrict u, int64_t row, int64_t plane,
                              const Real* __restrict c2, Real* __restrict old, Real dt2) {
  constexpr Real centre = 3 * w0, first = w1, second = w2, third = w3, fourth = w4;
  for (int64_t i = 0; i < count; ++i) {
    const auto ring = [&](int64_t k) {
      return ((u[i - k] + u[i + k]) + (u[i - k * row] + u[i + k * row])) + (u[i - k * plane] + u[i + k * plane]);
    };
    const Real lap = centre * u[i] + first * ring(1) + second * ring(2) + third * ring(3) + fourth * ring(4);
    old[i] = 2 * u[i] - old[i] + dt2 * c2[i] * lap;
  }
}

[[gnu::noinline]] void water(int64_t count, const double* __restrict u, const double* __restrict v,
                             const double* __restrict vs, const double* __restrict e, const double* __restrict es,
                             const double* __restrict en, const double* __restrict d, const double* __restrict ds,
                             const double* __restrict dn, double* __restrict next_u, double* __restrict next_v,
                             double* __restrict next_e, double half_dt, double g) {
  for (int64_t i = 0; i < count; ++i) {
    const double h = d[i] + e[i], east = h + (d[i + 1] + e[i + 1]), west = h + (d[i - 1] + e[i - 1]);
    const double north = h + (dn[i] + en[i]), south = h + (ds[i] + es[i]);
    next_e[i] = e[i] - half_dt * ((east * u[i] - west * u[i - 1]) + (north * v[i] - south * vs[i]));
    next_u[i] = u[i] - g * (e[i + 1] - e[i]);
    next_v[i] = v[i] - g * (en[i] - e[i]);
  }
}

template <class Real>
void fill_ends(Real* row, int64_t n, int64_t halo) {
  for (int64_t k = 0; k < halo; ++k) {
    row[-1 - k] = row[n - 1 - k];
    row[n + k] = row[k];
  }
}

/// The ghost rows of a plane, when its rows are complete with their ends.
template <class Real>
void fill_rows(Real* plane, const dpde_layout& layout) {
  const int64_t n = layout.cells[0], ny = layout.cells[1], halo = layout.halo[1], stride = layout.stride[1];
  const auto copy_row = [&](int64_t from, int64_t to) {
    std::copy_n(plane + from * stride - halo, n + 2 * halo, plane + to * stride - halo);
  };
  for (int64_t k = 0; k < halo; ++k) {
    copy_row(ny - 1 - k, -1 - k);
    copy_row(k, ny + k);
  }
}

/// The ghost planes, when the others are complete.
template <class Real>
void fill_planes(Real* field, const dpde_layout& layout) {
  const int64_t nz = layout.cells[2], halo = layout.halo[2], stride = layout.stride[2];
  const auto copy_plane = [&](int64_t from, int64_t to) {
    const int64_t first = -layout.halo[1] * layout.stride[1] - layout.halo[0],
                  count = (layout.cells[1] + 2 * layout.halo[1]) * layout.stride[1];
    std::copy_n(field + from * stride + first, count - layout.stride[1] + layout.cells[0] + 2 * layout.halo[0],
                field + to * stride + first);
  };
  for (int64_t k = 0; k < halo; ++k) {
    copy_plane(nz - 1 - k, -1 - k);
    copy_plane(k, nz + k);
  }
}

/// Calls row(place) for all rows of a 3-D grid, y in tiles, and fills the halo of `out`.
template <class Real, class Row>
void sweep_tiles(const dpde_layout& layout, Real* out, int64_t rows, const Row& row) {
  for (int64_t from = 0; from < layout.cells[1]; from += rows) {
    const int64_t to = std::min(from + rows, layout.cells[1]);
    for (int64_t z = 0; z < layout.cells[2]; ++z) {
      for (int64_t y = from; y < to; ++y) {
        const int64_t place = y * layout.stride[1] + z * layout.stride[2];
        row(place);
        fill_ends(out + place, layout.cells[0], layout.halo[0]);
      }
    }
  }
  for (int64_t z = 0; z < layout.cells[2]; ++z) fill_rows(out + z * layout.stride[2], layout);
  fill_planes(out, layout);
}

}  // namespace

void gray_scott_step(const dpde_layout& layout, const double* a, const double* b, double* next_a, double* next_b,
                     GrayScott p) {
  const int64_t n = layout.cells[0], stride = layout.stride[1];
  const double da = p.dt * p.da, db = p.dt * p.db;
  for (int64_t y = 0; y < layout.cells[1]; ++y) {
    const int64_t at = y * stride;
    gray_scott(n, a + at, a + at - stride, a + at + stride, b + at, b + at - stride, b + at + stride, next_a + at,
               next_b + at, da, db, p.dt, p.dt * p.feed, 1 - 4 * da - p.dt * p.feed,
               1 - 4 * db - p.dt * (p.feed + p.kill));
    fill_ends(next_a + at, n, 1);
    fill_ends(next_b + at, n, 1);
  }
  fill_rows(next_a, layout);
  fill_rows(next_b, layout);
}

void heat27_step(const dpde_layout& layout, const double* u, double* next, double c, int64_t rows) {
  const int64_t row = layout.stride[1], plane = layout.stride[2];
  sweep_tiles(layout, next, rows, [&](int64_t at) {
    const auto rows_at = [&](const double* middle) { return Plane{middle, middle - row, middle + row}; };
    heat27(layout.cells[0], rows_at(u + at - plane), rows_at(u + at), rows_at(u + at + plane), next + at,
           1 - 128 * c / 30, 14 * c / 30, 3 * c / 30, c / 30);
  });
}

template <class Real>
void wave25_step(const dpde_layout& layout, const Real* u, Real* old, const Real* c2, Real dt, int64_t rows) {
  sweep_tiles(layout, old, rows, [&](int64_t at) {
    wave25(layout.cells[0], u + at, layout.stride[1], layout.stride[2], c2 + at, old + at, dt * dt);
  });
}
template void wave25_step(const dpde_layout&, const double*, double*, const double*, double, int64_t);
template void wave25_step(const dpde_layout&, const float*, float*, const float*, float, int64_t);

void water_step(const dpde_layout& layout, Water from, const double* depth, NextWater to, double dt, double g) {
  const int64_t n = layout.cells[0], stride = layout.stride[1];
  for (int64_t y = 0; y < layout.cells[1]; ++y) {
    const int64_t at = y * stride;
    water(n, from.u + at, from.v + at, from.v + at - stride, from.eta + at, from.eta + at - stride,
          from.eta + at + stride, depth + at, depth + at - stride, depth + at + stride, to.u + at, to.v + at,
          to.eta + at, dt / 2, dt * g);
    for (double* field : {to.u, to.v, to.eta}) fill_ends(field + at, n, 1);
  }
  for (double* field : {to.u, to.v, to.eta}) fill_rows(field, layout);
}

}  // namespace dpde::handwritten
