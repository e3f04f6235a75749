// SPDX-License-Identifier: Apache-2.0
#include "solve/multigrid.h"

#include <algorithm>
#include <utility>

namespace dpde {
namespace {

/// Steps from a cell to its neighbours; around both ends of an axis. Beyond bounded ends couplings are 0, so that
/// wrapping reads something and takes nothing of it.
struct Steps {
  std::int64_t row, right, left, up, down, above, below;
};

template <class F>
void for_each_row(const MultigridLevel& level, bool is_reversed, const F& f) {
  const auto [nx, ny, nz] = level.cells;
  for (std::int64_t row = 0; row < ny * nz; ++row) {
    const std::int64_t number = is_reversed ? ny * nz - 1 - row : row, j = number % ny, k = number / ny;
    f(j + k, Steps{number * nx, 1, -1, (j + 1 == ny ? -j : 1) * nx, (j == 0 ? ny - 1 : -1) * nx,
                   (k + 1 == nz ? -k : 1) * nx * ny, (k == 0 ? nz - 1 : -1) * nx * ny});
  }
}

/// sum w*x of the neighbours
template <int rank>
struct NeighbourSum {
  explicit NeighbourSum(const MultigridLevel& level)
      : wx(level.coupling[0].data()), wy(level.coupling[1].data()), wz(level.coupling[2].data()), x(level.x.data()) {}
  double operator()(std::int64_t c, const Steps& to) const {
    double sum = wx[c] * x[c + to.right] + wx[c + to.left] * x[c + to.left];
    if constexpr (rank > 1) sum += wy[c] * x[c + to.up] + wy[c + to.down] * x[c + to.down];
    if constexpr (rank > 2) sum += wz[c] * x[c + to.above] + wz[c + to.below] * x[c + to.below];
    return sum;
  }
  const double *wx, *wy, *wz, *x;
};

/// x = (b + sum w*x of neighbours)*inverse in the cells of one colour; in the reverse order backwards, which matters
/// where two of a colour are neighbours around an odd ring.
template <int rank>
void smooth_rows(MultigridLevel& level, int colour, bool is_reversed) {
  const std::int64_t nx = level.cells[0];
  const NeighbourSum<rank> sum(level);
  const double *b = level.b.data(), *inverse = level.inverse.data();
  double* x = level.x.data();
  for_each_row(level, is_reversed, [&](std::int64_t parity, Steps to) {
    const std::int64_t begin = (colour + parity) & 1, row = to.row;
    const auto ends = [&](bool is_last) {
      const std::int64_t i = is_last ? nx - 1 : 0;
      if (i % 2 != begin || (is_last && nx == 1)) return;
      Steps around = to;
      if (i + 1 == nx) around.right = -i;
      if (i == 0) around.left = nx - 1;
      x[row + i] = (b[row + i] + sum(row + i, around)) * inverse[row + i];
    };
    to.right = 1, to.left = -1;
    ends(is_reversed);
    for (std::int64_t c = row + (begin == 0 ? 2 : 1); c < row + nx - 1; c += 2) x[c] = (b[c] + sum(c, to)) * inverse[c];
    ends(!is_reversed);
  });
}

template <int rank>
void find_residual(MultigridLevel& level) {
  const std::int64_t nx = level.cells[0];
  const NeighbourSum<rank> sum(level);
  const double *b = level.b.data(), *diagonal = level.diagonal.data(), *x = level.x.data();
  double* r = level.residual.data();
  for_each_row(level, false, [&](std::int64_t, const Steps& to) {
    Steps first = to, last = to;
    first.left = nx - 1, last.right = 1 - nx;
    if (nx == 1) first.right = 0;
    const auto at = [&](std::int64_t c, const Steps& steps) { r[c] = b[c] - diagonal[c] * x[c] + sum(c, steps); };
    at(to.row, first);
    for (std::int64_t c = to.row + 1; c < to.row + nx - 1; ++c) at(c, to);
    if (nx > 1) at(to.row + nx - 1, last);
  });
}

void smooth(MultigridLevel& level, int colour, bool is_reversed) {
  if (level.cells[2] > 1) return smooth_rows<3>(level, colour, is_reversed);
  if (level.cells[1] > 1) return smooth_rows<2>(level, colour, is_reversed);
  smooth_rows<1>(level, colour, is_reversed);
}

void find_residual(MultigridLevel& level) {
  if (level.cells[2] > 1) return find_residual<3>(level);
  if (level.cells[1] > 1) return find_residual<2>(level);
  find_residual<1>(level);
}

/// The residual of one fine row on the coarse cells along it.
void restrict_row(const AxisInterpolation& from, const double* fine, std::span<double> coarse) {
  if (!from.is_halved) return void(std::copy_n(fine, coarse.size(), coarse.begin()));
  const double *before = from.weights[0].data(), *first = from.weights[1].data(), *second = from.weights[2].data(),
               *after = from.weights[3].data();
  for (std::size_t i = 1; i + 1 < coarse.size(); ++i) {
    const double* at = fine + 2 * i;
    coarse[i] = before[i] * at[-1] + first[i] * at[0] + second[i] * at[1] + after[i] * at[2];
  }
  coarse.front() = coarse.back() = 0;
  for (const AxisInterpolation::End& end : from.ends) coarse[end.coarse] += end.weight * fine[end.fine];
}

/// The up to four coarse rows that a fine row is interpolated from: `f`(first cell of the row, weight).
template <class F>
void for_each_coarse_row(const MultigridLevel& fine, const MultigridLevel& coarse, std::int64_t row, const F& f) {
  const auto j = static_cast<std::size_t>(row % fine.cells[1]), k = static_cast<std::size_t>(row / fine.cells[1]);
  const AxisInterpolation &y = fine.from[1], &z = fine.from[2];
  for (const auto& [plane, in_z] : {std::pair{z.near[k], z.near_weight[k]}, std::pair{z.far[k], z.far_weight[k]}}) {
    for (const auto& [line, in_y] : {std::pair{y.near[j], y.near_weight[j]}, std::pair{y.far[j], y.far_weight[j]}}) {
      const double weight = in_y * in_z;
      if (weight != 0) f(coarse.cells[0] * (line + coarse.cells[1] * plane), weight);
    }
  }
}

void restrict_residual(const MultigridLevel& fine, MultigridLevel& coarse) {
  std::ranges::fill(coarse.b, 0.0);
  double* line = coarse.line.data();
  const std::int64_t nx = coarse.cells[0];
  for (std::int64_t row = 0; row < fine.cells[1] * fine.cells[2]; ++row) {
    restrict_row(fine.from[0], fine.residual.data() + row * fine.cells[0], coarse.line);
    for_each_coarse_row(fine, coarse, row, [&](std::int64_t to, double weight) {
      double* b = coarse.b.data() + to;
      for (std::int64_t i = 0; i < nx; ++i) b[i] += weight * line[i];
    });
  }
}

void add_correction(MultigridLevel& fine, MultigridLevel& coarse) {
  const AxisInterpolation& along = fine.from[0];
  const std::uint32_t *near = along.near.data(), *far = along.far.data();
  const double *near_weight = along.near_weight.data(), *far_weight = along.far_weight.data();
  double* line = coarse.line.data();
  const std::int64_t nx = coarse.cells[0];
  for (std::int64_t row = 0; row < fine.cells[1] * fine.cells[2]; ++row) {
    std::ranges::fill(coarse.line, 0.0);
    for_each_coarse_row(fine, coarse, row, [&](std::int64_t from, double weight) {
      const double* x = coarse.x.data() + from;
      for (std::int64_t i = 0; i < nx; ++i) line[i] += weight * x[i];
    });
    double* x = fine.x.data() + row * fine.cells[0];
    for (std::int64_t i = 0; i < fine.cells[0]; ++i)
      x[i] += near_weight[i] * line[near[i]] + far_weight[i] * line[far[i]];
  }
}

}  // namespace

void Multigrid::descend(std::size_t level) {
  Level& here = levels_[level];
  if (level + 1 == levels_.size()) return coarsest_->solve(here.b, here.x);
  std::ranges::fill(here.x, 0.0);
  smooth(here, 0, false);
  smooth(here, 1, false);
  find_residual(here);
  restrict_residual(here, levels_[level + 1]);
  descend(level + 1);
  add_correction(here, levels_[level + 1]);
  smooth(here, is_symmetric_ ? 1 : 0, is_symmetric_);
  smooth(here, is_symmetric_ ? 0 : 1, is_symmetric_);
}

void Multigrid::cycle(std::span<const double> b, std::span<double> x) {
  Level& finest = levels_.front();
  for (std::size_t i = 0; i < b.size(); ++i) finest.b[i] = sign_ * b[i];
  descend(0);
  std::ranges::copy(finest.x, x.begin());
}

}  // namespace dpde
