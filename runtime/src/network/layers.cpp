// SPDX-License-Identifier: Apache-2.0
#include "network/layers.h"

#include <algorithm>
#include <cstdlib>

namespace dpde::nn {
namespace {

int64_t offset(const Shape& shape, const Axes& cell) {
  return cell[0] + cell[1] * shape.stride[1] + cell[2] * shape.stride[2];
}

/// The rows of fine cells under one coarse row.
struct RowPool {
  std::array<int64_t, 2> begin{}, end{};  // y, z

  int64_t rows() const { return (end[0] - begin[0]) * (end[1] - begin[1]); }
  template <class F>
  void for_each(const Shape& fine, const F& f) const {
    for (int64_t z = begin[1]; z < end[1]; ++z) {
      for (int64_t y = begin[0]; y < end[0]; ++y) f(offset(fine, {0, y, z}));
    }
  }
};

/// Calls `f(offset of the coarse row, its pool)`; fewer rows at an end that the stride does not divide.
template <class F>
void for_each_coarse_row(int64_t stride, const Shape& fine, const Shape& coarse, const F& f) {
  for (int64_t z = 0; z < coarse.cells[2]; ++z) {
    for (int64_t y = 0; y < coarse.cells[1]; ++y) {
      const int64_t fine_y = y * stride, fine_z = z * stride;
      f(offset(coarse, {0, y, z}),
        RowPool{{fine_y, fine_z},
                {std::min(fine_y + stride, fine.cells[1]), std::min(fine_z + stride, fine.cells[2])}});
    }
  }
}

/// Calls `f(offset of the coarse cell, offset of its first fine cell with the largest value)`.
template <class Real, class F>
void for_each_largest(int64_t stride, const Shape& fine, const Shape& coarse, const Real* plane, const F& f) {
  constexpr int64_t at_once = 64;  // coarse cells
  for_each_coarse_row(stride, fine, coarse, [&](int64_t coarse_row, const RowPool& pool) {
    for (int64_t first = 0; first < coarse.cells[0]; first += at_once) {
      const int64_t count = std::min(at_once, coarse.cells[0] - first);
      Real most[at_once];
      int64_t column[at_once]{}, line[at_once]{};
      const Real* const begin = plane + offset(fine, {first * stride, pool.begin[0], pool.begin[1]});
      for (int64_t x = 0; x < count; ++x) most[x] = begin[x * stride];
      int64_t number = 0;
      pool.for_each(fine, [&](int64_t fine_row) {
        const Real* const row = plane + fine_row + first * stride;
        for (int64_t k = 0; k < stride; ++k) {
          const int64_t whole = std::min(count, (fine.cells[0] - first * stride - k + stride - 1) / stride);
          for (int64_t x = 0; x < whole; ++x) {
            const bool larger = row[x * stride + k] > most[x];
            most[x] = larger ? row[x * stride + k] : most[x];
            column[x] = larger ? k : column[x];
            line[x] = larger ? number : line[x];
          }
        }
        ++number;
      });
      const int64_t ny = pool.end[0] - pool.begin[0];
      for (int64_t x = 0; x < count; ++x) {
        f(coarse_row + first + x,
          Axes{(first + x) * stride + column[x], pool.begin[0] + line[x] % ny, pool.begin[1] + line[x] / ny});
      }
    }
  });
}

/// Calls `f(to[x], from[x / stride])` for x in 0 .. count-1.
template <class Real, class F>
void spread(int64_t stride, const Real* __restrict from, int64_t count, Real* __restrict to, const F& f) {
  if (stride == 2) {
    for (int64_t x = 0; x < count / 2; ++x) {
      f(to[2 * x], from[x]);
      f(to[2 * x + 1], from[x]);
    }
    if (count % 2 == 1) f(to[count - 1], from[count / 2]);
    return;
  }
  for (int64_t begin = 0, x = 0; begin < count; begin += stride, ++x) {
    const int64_t end = std::min(begin + stride, count);
    for (int64_t i = begin; i < end; ++i) f(to[i], from[x]);
  }
}

/// to[x / stride] += from[x] for x in 0 .. count-1.
template <class Real>
void add_pieces(int64_t stride, const Real* __restrict from, int64_t count, Real* __restrict to) {
  if (stride == 2) {
    for (int64_t x = 0; x < count / 2; ++x) to[x] += from[2 * x] + from[2 * x + 1];
    if (count % 2 == 1) to[count / 2] += from[count - 1];
    return;
  }
  for (int64_t begin = 0, x = 0; begin < count; begin += stride, ++x) {
    const int64_t end = std::min(begin + stride, count);
    for (int64_t i = begin; i < end; ++i) to[x] += from[i];
  }
}

/// Calls `f(row of the result, the input cell of its first cell, step to the next input cells, sign)` for rows of a
/// DPDE_REORIENT.
template <class Real, class F>
void for_each_turned_row(const Team& team, const Step& step, const View<Real>& input, const View<Real>& result,
                         const F& f) {
  const Shape &from = *input.shape, &to = *result.shape;
  Axes stride{};
  int64_t first = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    const int32_t source = step.layer.axes[axis];
    const auto along = static_cast<size_t>(std::abs(source) - 1);
    stride[axis] = source > 0 ? from.stride[along] : -from.stride[along];
    if (source < 0) first += (from.cells[along] - 1) * from.stride[along];
  }
  const int64_t rows = to.rows(), all = to.channels * rows;
  parallel_pieces(team, all, 1, all * to.cells[0], [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const int64_t channel = i / rows, row = i % rows,
                    source = step.order.empty() ? channel + 1 : step.order[static_cast<size_t>(channel)];
      f(result.row(channel, row),
        input.plane(std::abs(source) - 1) + first + row % to.cells[1] * stride[1] + row / to.cells[1] * stride[2],
        stride[0], source > 0 ? Real(1) : Real(-1));
    }
  });
}

template <class Real, class F>
void for_each_channel(const Team& team, const View<Real>& view, const F& f) {
  parallel(team, view.shape->channels, view.shape->channels * view.shape->rows() * view.shape->cells[0], f);
}

}  // namespace

template <class Real>
void copy_channels(const Team& team, const View<Real>& from, int64_t first, const View<Real>& to, int64_t to_first,
                   int64_t count, bool add) {
  const int64_t cells = from.shape->cells[0];
  parallel(team, count, count * from.shape->rows() * cells / 4, [&](int64_t channel) {
    for (int64_t number = 0; number < from.shape->rows(); ++number) {
      const Real* const source = from.row(first + channel, number);
      Real* const target = to.row(to_first + channel, number);
      if (!add) {
        std::copy_n(source, cells, target);
        continue;
      }
      for (int64_t x = 0; x < cells; ++x) target[x] += source[x];
    }
  });
}

template <class Real>
void clear_cells(const Team& team, const View<Real>& view) {
  for_each_channel(team, view, [&](int64_t channel) {
    for (int64_t number = 0; number < view.shape->rows(); ++number)
      std::fill_n(view.row(channel, number), view.shape->cells[0], Real(0));
  });
}

template <class Real>
void mean_pool(const Team& team, int64_t stride, const View<Real>& fine, const View<Real>& coarse) {
  const int64_t cells = coarse.shape->cells[0], cut = fine.shape->cells[0] - (cells - 1) * stride;
  for_each_channel(team, fine, [&](int64_t channel) {
    for_each_coarse_row(stride, *fine.shape, *coarse.shape, [&](int64_t row, const RowPool& pool) {
      Real* const to = coarse.plane(channel) + row;
      std::fill_n(to, cells, Real(0));
      pool.for_each(*fine.shape, [&](int64_t fine_row) {
        add_pieces(stride, fine.plane(channel) + fine_row, fine.shape->cells[0], to);
      });
      const Real share = Real(1) / static_cast<Real>(pool.rows() * stride);
      for (int64_t x = 0; x < cells - 1; ++x) to[x] *= share;
      to[cells - 1] *= Real(1) / static_cast<Real>(pool.rows() * cut);
    });
  });
}

template <class Real>
void add_mean_pool_adjoint(const Team& team, int64_t stride, const View<Real>& coarse_bar, const View<Real>& fine_bar) {
  const int64_t cells = coarse_bar.shape->cells[0], cut = fine_bar.shape->cells[0] - (cells - 1) * stride;
  for_each_channel(team, fine_bar, [&](int64_t channel) {
    for_each_coarse_row(stride, *fine_bar.shape, *coarse_bar.shape, [&](int64_t row, const RowPool& pool) {
      const Real* const from = coarse_bar.plane(channel) + row;
      const Real share = Real(1) / static_cast<Real>(pool.rows() * stride),
                 last = from[cells - 1] / static_cast<Real>(pool.rows() * cut);
      pool.for_each(*fine_bar.shape, [&](int64_t fine_row) {
        Real* const to = fine_bar.plane(channel) + fine_row;
        spread(stride, from, (cells - 1) * stride, to, [share](Real& target, Real value) { target += share * value; });
        for (int64_t x = (cells - 1) * stride; x < fine_bar.shape->cells[0]; ++x) to[x] += last;
      });
    });
  });
}

template <class Real>
void max_pool(const Team& team, int64_t stride, const View<Real>& fine, const View<Real>& taken,
              const View<Real>& coarse) {
  for_each_channel(team, fine, [&](int64_t channel) {
    const Real* const from = taken.plane(channel);
    Real* const to = coarse.plane(channel);
    for_each_largest(stride, *fine.shape, *coarse.shape, fine.plane(channel),
                     [&](int64_t cell, const Axes& largest) { to[cell] = from[offset(*taken.shape, largest)]; });
  });
}

template <class Real>
void add_max_pool_adjoint(const Team& team, int64_t stride, const View<Real>& fine, const View<Real>& coarse_bar,
                          const View<Real>& fine_bar) {
  for_each_channel(team, fine, [&](int64_t channel) {
    const Real* const from = coarse_bar.plane(channel);
    Real* const to = fine_bar.plane(channel);
    for_each_largest(stride, *fine.shape, *coarse_bar.shape, fine.plane(channel),
                     [&](int64_t cell, const Axes& largest) { to[offset(*fine_bar.shape, largest)] += from[cell]; });
  });
}

template <class Real>
void upsample(const Team& team, int64_t stride, const View<Real>& coarse, const View<Real>& fine) {
  for_each_channel(team, fine, [&](int64_t channel) {
    for_each_coarse_row(stride, *fine.shape, *coarse.shape, [&](int64_t row, const RowPool& pool) {
      pool.for_each(*fine.shape, [&](int64_t fine_row) {
        spread(stride, coarse.plane(channel) + row, fine.shape->cells[0], fine.plane(channel) + fine_row,
               [](Real& target, Real value) { target = value; });
      });
    });
  });
}

template <class Real>
void add_upsample_adjoint(const Team& team, int64_t stride, const View<Real>& fine_bar, const View<Real>& coarse_bar) {
  for_each_channel(team, fine_bar, [&](int64_t channel) {
    for_each_coarse_row(stride, *fine_bar.shape, *coarse_bar.shape, [&](int64_t row, const RowPool& pool) {
      pool.for_each(*fine_bar.shape, [&](int64_t fine_row) {
        add_pieces(stride, fine_bar.plane(channel) + fine_row, fine_bar.shape->cells[0],
                   coarse_bar.plane(channel) + row);
      });
    });
  });
}

template <class Real>
void fix_sum(const Team& team, Real sum, const View<Real>& values, const View<Real>& results, bool add) {
  const int64_t channels = values.shape->channels, cells = values.shape->cells[0];
  constexpr int64_t at_once = 64;  // cells
  parallel(team, values.shape->rows(), channels * values.shape->rows() * cells / 4, [&](int64_t number) {
    for (int64_t first = 0; first < cells; first += at_once) {
      const int64_t count = std::min(at_once, cells - first);
      Real corrections[at_once]{};
      for (int64_t channel = 0; channel < channels; ++channel) {
        const Real* const from = values.row(channel, number) + first;
        for (int64_t x = 0; x < count; ++x) corrections[x] += from[x];
      }
      for (int64_t x = 0; x < count; ++x) corrections[x] = (sum - corrections[x]) / static_cast<Real>(channels);
      for (int64_t channel = 0; channel < channels; ++channel) {
        const Real* const from = values.row(channel, number) + first;
        Real* const to = results.row(channel, number) + first;
        for (int64_t x = 0; x < count; ++x) to[x] = (add ? to[x] : Real(0)) + (from[x] + corrections[x]);
      }
    }
  });
}

template <class Real>
void reorient(const Team& team, const Step& step, const View<Real>& input, const View<Real>& result) {
  const int64_t cells = result.shape->cells[0];
  for_each_turned_row(team, step, input, result, [cells](Real* to, const Real* from, int64_t apart, Real sign) {
    for (int64_t x = 0; x < cells; ++x) to[x] = sign * from[x * apart];
  });
}

template <class Real>
void reorient_back(const Team& team, const Step& step, const View<Real>& result_bar, const View<Real>& input_bar,
                   bool add) {
  const int64_t cells = result_bar.shape->cells[0];
  for_each_turned_row(team, step, input_bar, result_bar,
                      [cells, add](const Real* from, Real* to, int64_t apart, Real sign) {
                        for (int64_t x = 0; x < cells; ++x)
                          to[x * apart] = (add ? to[x * apart] : Real(0)) + sign * from[x];
                      });
}

template void copy_channels(const Team&, const View<float>&, int64_t, const View<float>&, int64_t, int64_t, bool);
template void copy_channels(const Team&, const View<double>&, int64_t, const View<double>&, int64_t, int64_t, bool);
template void clear_cells(const Team&, const View<float>&);
template void clear_cells(const Team&, const View<double>&);
template void mean_pool(const Team&, int64_t, const View<float>&, const View<float>&);
template void mean_pool(const Team&, int64_t, const View<double>&, const View<double>&);
template void add_mean_pool_adjoint(const Team&, int64_t, const View<float>&, const View<float>&);
template void add_mean_pool_adjoint(const Team&, int64_t, const View<double>&, const View<double>&);
template void max_pool(const Team&, int64_t, const View<float>&, const View<float>&, const View<float>&);
template void max_pool(const Team&, int64_t, const View<double>&, const View<double>&, const View<double>&);
template void add_max_pool_adjoint(const Team&, int64_t, const View<float>&, const View<float>&, const View<float>&);
template void add_max_pool_adjoint(const Team&, int64_t, const View<double>&, const View<double>&, const View<double>&);
template void upsample(const Team&, int64_t, const View<float>&, const View<float>&);
template void upsample(const Team&, int64_t, const View<double>&, const View<double>&);
template void add_upsample_adjoint(const Team&, int64_t, const View<float>&, const View<float>&);
template void add_upsample_adjoint(const Team&, int64_t, const View<double>&, const View<double>&);
template void fix_sum(const Team&, float, const View<float>&, const View<float>&, bool);
template void fix_sum(const Team&, double, const View<double>&, const View<double>&, bool);
template void reorient(const Team&, const Step&, const View<float>&, const View<float>&);
template void reorient(const Team&, const Step&, const View<double>&, const View<double>&);
template void reorient_back(const Team&, const Step&, const View<float>&, const View<float>&, bool);
template void reorient_back(const Team&, const Step&, const View<double>&, const View<double>&, bool);

}  // namespace dpde::nn
