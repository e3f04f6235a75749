// SPDX-License-Identifier: Apache-2.0
#include "layers.h"

#include <algorithm>

namespace dpde::nn {
namespace {

int64_t offset(const Shape& shape, const Axes& cell) { return cell[0] + cell[1] * shape.stride[1] + cell[2] * shape.stride[2]; }

/// Fine cells that one coarse cell stands for: fewer at an end that the stride does not divide.
struct Pool {
  Axes begin{}, end{};

  Pool(const Axes& coarse, int64_t stride, const Shape& fine) {
    for (size_t axis = 0; axis < 3; ++axis) {
      begin[axis] = coarse[axis] * stride;
      end[axis] = std::min(begin[axis] + stride, fine.cells[axis]);
    }
  }
  int64_t count() const { return (end[0] - begin[0]) * (end[1] - begin[1]) * (end[2] - begin[2]); }

  template <class F>
  void for_each(const F& f) const {
    for (int64_t z = begin[2]; z < end[2]; ++z) {
      for (int64_t y = begin[1]; y < end[1]; ++y) {
        for (int64_t x = begin[0]; x < end[0]; ++x) f(Axes{x, y, z});
      }
    }
  }
  /// The first of the largest.
  template <class Real>
  Axes largest(const Real* plane, const Shape& fine) const {
    Axes place = begin;
    for_each([&](const Axes& cell) {
      if (plane[offset(fine, cell)] > plane[offset(fine, place)]) place = cell;
    });
    return place;
  }
};

/// `f(offset of the coarse cell, its pool)`.
template <class F>
void for_each_pool(int64_t stride, const Shape& fine, const Shape& coarse, const F& f) {
  for (int64_t z = 0; z < coarse.cells[2]; ++z) {
    for (int64_t y = 0; y < coarse.cells[1]; ++y) {
      for (int64_t x = 0; x < coarse.cells[0]; ++x) f(offset(coarse, {x, y, z}), Pool({x, y, z}, stride, fine));
    }
  }
}

template <class Real, class F>
void for_each_channel(int threads, const View<Real>& view, const F& f) {
  parallel(threads, view.shape->channels, view.shape->channels * view.shape->rows() * view.shape->cells[0], f);
}

}  // namespace

template <class Real>
void copy_channels(int threads, const View<Real>& from, int64_t first, const View<Real>& to, int64_t to_first, int64_t count, bool add) {
  const int64_t cells = from.shape->cells[0];
  parallel(threads, count, count * from.shape->rows() * cells / 4, [&](int64_t channel) {
    for (int64_t number = 0; number < from.shape->rows(); ++number) {
      const Real* const source = from.row(first + channel, number);
      Real* const target = to.row(to_first + channel, number);
      for (int64_t x = 0; x < cells; ++x) target[x] = add ? target[x] + source[x] : source[x];
    }
  });
}

template <class Real>
void clear_cells(int threads, const View<Real>& view) {
  for_each_channel(threads, view, [&](int64_t channel) {
    for (int64_t number = 0; number < view.shape->rows(); ++number) std::fill_n(view.row(channel, number), view.shape->cells[0], Real(0));
  });
}

template <class Real>
void mean_pool(int threads, int64_t stride, const View<Real>& fine, const View<Real>& coarse) {
  for_each_channel(threads, fine, [&](int64_t channel) {
    const Real* const from = fine.plane(channel);
    Real* const to = coarse.plane(channel);
    for_each_pool(stride, *fine.shape, *coarse.shape, [&](int64_t cell, const Pool& pool) {
      Real sum = 0;
      pool.for_each([&](const Axes& at) { sum += from[offset(*fine.shape, at)]; });
      to[cell] = sum / static_cast<Real>(pool.count());
    });
  });
}

template <class Real>
void add_mean_pool_adjoint(int threads, int64_t stride, const View<Real>& coarse_bar, const View<Real>& fine_bar) {
  for_each_channel(threads, fine_bar, [&](int64_t channel) {
    const Real* const from = coarse_bar.plane(channel);
    Real* const to = fine_bar.plane(channel);
    for_each_pool(stride, *fine_bar.shape, *coarse_bar.shape, [&](int64_t cell, const Pool& pool) {
      const Real share = from[cell] / static_cast<Real>(pool.count());
      pool.for_each([&](const Axes& at) { to[offset(*fine_bar.shape, at)] += share; });
    });
  });
}

template <class Real>
void max_pool(int threads, int64_t stride, const View<Real>& fine, const View<Real>& taken, const View<Real>& coarse) {
  for_each_channel(threads, fine, [&](int64_t channel) {
    const Real *const values = fine.plane(channel), *const from = taken.plane(channel);
    Real* const to = coarse.plane(channel);
    for_each_pool(stride, *fine.shape, *coarse.shape,
                  [&](int64_t cell, const Pool& pool) { to[cell] = from[offset(*taken.shape, pool.largest(values, *fine.shape))]; });
  });
}

template <class Real>
void add_max_pool_adjoint(int threads, int64_t stride, const View<Real>& fine, const View<Real>& coarse_bar, const View<Real>& fine_bar) {
  for_each_channel(threads, fine, [&](int64_t channel) {
    const Real *const values = fine.plane(channel), *const from = coarse_bar.plane(channel);
    Real* const to = fine_bar.plane(channel);
    for_each_pool(stride, *fine.shape, *coarse_bar.shape,
                  [&](int64_t cell, const Pool& pool) { to[offset(*fine_bar.shape, pool.largest(values, *fine.shape))] += from[cell]; });
  });
}

template <class Real>
void upsample(int threads, int64_t stride, const View<Real>& coarse, const View<Real>& fine) {
  for_each_channel(threads, fine, [&](int64_t channel) {
    const Real* const from = coarse.plane(channel);
    Real* const to = fine.plane(channel);
    for_each_pool(stride, *fine.shape, *coarse.shape, [&](int64_t cell, const Pool& pool) {
      pool.for_each([&](const Axes& at) { to[offset(*fine.shape, at)] = from[cell]; });
    });
  });
}

template <class Real>
void add_upsample_adjoint(int threads, int64_t stride, const View<Real>& fine_bar, const View<Real>& coarse_bar) {
  for_each_channel(threads, fine_bar, [&](int64_t channel) {
    const Real* const from = fine_bar.plane(channel);
    Real* const to = coarse_bar.plane(channel);
    for_each_pool(stride, *fine_bar.shape, *coarse_bar.shape, [&](int64_t cell, const Pool& pool) {
      Real sum = 0;
      pool.for_each([&](const Axes& at) { sum += from[offset(*fine_bar.shape, at)]; });
      to[cell] += sum;
    });
  });
}

template <class Real>
void fix_sum(int threads, Real sum, const View<Real>& values, const View<Real>& results, bool add) {
  const int64_t channels = values.shape->channels, cells = values.shape->cells[0];
  parallel(threads, values.shape->rows(), channels * values.shape->rows() * cells, [&](int64_t number) {
    for (int64_t x = 0; x < cells; ++x) {
      Real all = 0;
      for (int64_t channel = 0; channel < channels; ++channel) all += values.row(channel, number)[x];
      const Real correction = (sum - all) / static_cast<Real>(channels);
      for (int64_t channel = 0; channel < channels; ++channel) {
        Real& result = results.row(channel, number)[x];
        const Real value = values.row(channel, number)[x] + correction;
        result = add ? result + value : value;
      }
    }
  });
}

template void copy_channels(int, const View<float>&, int64_t, const View<float>&, int64_t, int64_t, bool);
template void copy_channels(int, const View<double>&, int64_t, const View<double>&, int64_t, int64_t, bool);
template void clear_cells(int, const View<float>&);
template void clear_cells(int, const View<double>&);
template void mean_pool(int, int64_t, const View<float>&, const View<float>&);
template void mean_pool(int, int64_t, const View<double>&, const View<double>&);
template void add_mean_pool_adjoint(int, int64_t, const View<float>&, const View<float>&);
template void add_mean_pool_adjoint(int, int64_t, const View<double>&, const View<double>&);
template void max_pool(int, int64_t, const View<float>&, const View<float>&, const View<float>&);
template void max_pool(int, int64_t, const View<double>&, const View<double>&, const View<double>&);
template void add_max_pool_adjoint(int, int64_t, const View<float>&, const View<float>&, const View<float>&);
template void add_max_pool_adjoint(int, int64_t, const View<double>&, const View<double>&, const View<double>&);
template void upsample(int, int64_t, const View<float>&, const View<float>&);
template void upsample(int, int64_t, const View<double>&, const View<double>&);
template void add_upsample_adjoint(int, int64_t, const View<float>&, const View<float>&);
template void add_upsample_adjoint(int, int64_t, const View<double>&, const View<double>&);
template void fix_sum(int, float, const View<float>&, const View<float>&, bool);
template void fix_sum(int, double, const View<double>&, const View<double>&, bool);

}  // namespace dpde::nn
