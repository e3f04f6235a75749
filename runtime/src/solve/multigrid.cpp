// SPDX-License-Identifier: Apache-2.0
#include "solve/multigrid.h"

#include <algorithm>
#include <cmath>

namespace dpde {
namespace {

constexpr std::size_t most_of_coarsest = 64;
constexpr double least_coupling = 0.25;  // of the strongest axis

using GridPlace = std::array<std::int64_t, 3>;

template <class F>
void for_each_cell(const std::array<std::int64_t, 3>& cells, const F& f) {
  std::size_t number = 0;
  for (std::int64_t z = 0; z < cells[2]; ++z) {
    for (std::int64_t y = 0; y < cells[1]; ++y) {
      for (std::int64_t x = 0; x < cells[0]; ++x) f(number++, GridPlace{x, y, z});
    }
  }
}

std::size_t number_of(const std::array<std::int64_t, 3>& cells, const GridPlace& cell) {
  return static_cast<std::size_t>(cell[0] + cells[0] * (cell[1] + cells[1] * cell[2]));
}

/// Of the neighbour at +-1 along an axis; -1 beyond a wall.
std::int64_t neighbour(const std::array<std::int64_t, 3>& cells, const std::array<bool, 3>& periodic, GridPlace cell,
                       std::size_t axis, int step) {
  cell[axis] += step;
  if (periodic[axis]) cell[axis] = (cell[axis] + cells[axis]) % cells[axis];
  if (cell[axis] < 0 || cell[axis] >= cells[axis]) return -1;
  return static_cast<std::int64_t>(number_of(cells, cell));
}

/// Along which axis, and which way; nothing for what is no neighbour.
std::optional<std::pair<std::size_t, int>> axis_of(const std::array<int, 3>& offset) {
  std::optional<std::pair<std::size_t, int>> found;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (offset[axis] == 0) continue;
    if (found || std::abs(offset[axis]) != 1) return std::nullopt;
    found = {axis, offset[axis]};
  }
  return found;
}

}  // namespace

std::optional<Multigrid> Multigrid::of(const StencilMatrix& matrix, const NullSpace& null_space, double rounding,
                                       bool is_symmetric) {
  if (null_space.is_lopsided()) return std::nullopt;
  double largest = 0;
  for (const std::vector<double>& column : matrix.values) {
    for (const double value : column) largest = std::max(largest, std::abs(value));
  }
  const double zero = 64 * rounding * largest;
  for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
    if (matrix.offsets[k] != std::array{0, 0, 0} && !axis_of(matrix.offsets[k]) &&
        std::ranges::any_of(matrix.values[k], [&](double value) { return std::abs(value) > zero; }))
      return std::nullopt;
  }
  const StencilMatrix other = transposed(matrix);
  for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
    const auto same = std::ranges::find(other.offsets, matrix.offsets[k]);
    for (std::size_t i = 0; i < matrix.values[k].size(); ++i) {
      const double mirrored =
          same == other.offsets.end() ? 0 : other.values[static_cast<std::size_t>(same - other.offsets.begin())][i];
      if (std::abs(matrix.values[k][i] - mirrored) > zero) return std::nullopt;
    }
  }
  std::optional<Multigrid> result = of_symmetric_part(matrix, rounding);
  if (result) result->is_symmetric_ = is_symmetric;
  return result;
}

std::optional<Multigrid> Multigrid::of_symmetric_part(const StencilMatrix& matrix, double rounding) {
  Level level;
  level.cells = matrix.cells;
  level.periodic = matrix.periodic;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (matrix.cells[axis] == 1) level.periodic[axis] = false;
    if (matrix.periodic[axis] && matrix.cells[axis] == 2) return std::nullopt;  // two ways to one neighbour
  }
  const auto size = static_cast<std::size_t>(matrix.size());
  std::vector<double> diagonal(size, 0.0);
  for (auto& coupling : level.coupling) coupling.assign(size, 0.0);
  double trace = 0, largest = 0;
  for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
    const auto axis = axis_of(matrix.offsets[k]);
    const bool is_diagonal = matrix.offsets[k] == std::array{0, 0, 0};
    if (!axis && !is_diagonal) continue;
    for_each_cell(matrix.cells, [&](std::size_t number, const GridPlace& cell) {
      const double value = matrix.values[k][number];
      if (value == 0) return;
      largest = std::max(largest, std::abs(value));
      if (is_diagonal || level.cells[axis->first] == 1) {
        diagonal[number] += value;
        trace += value;
        return;
      }
      const std::int64_t other = neighbour(level.cells, level.periodic, cell, axis->first, axis->second);
      if (other < 0) return;
      level.coupling[axis->first][axis->second > 0 ? number : static_cast<std::size_t>(other)] -= value / 2;
    });
  }
  const double sign = trace < 0 ? -1 : 1, zero = 64 * rounding * largest;
  for (auto& coupling : level.coupling) {
    for (double& w : coupling) {
      w *= sign;
      if (w < -zero) return std::nullopt;
      if (w < zero) w = 0;
    }
  }
  level.rest.resize(size);
  bool is_dominant = true;
  for_each_cell(level.cells, [&](std::size_t number, const GridPlace& cell) {
    double rest = sign * diagonal[number];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      rest -= level.coupling[axis][number];
      const std::int64_t before = neighbour(level.cells, level.periodic, cell, axis, -1);
      if (before >= 0) rest -= level.coupling[axis][static_cast<std::size_t>(before)];
    }
    is_dominant = is_dominant && rest > -8 * zero;
    level.rest[number] = rest < 8 * zero ? 0 : rest;
  });
  if (!is_dominant) return std::nullopt;
  return make(std::move(level), sign);
}

void Multigrid::set_inverse(Level& level) {
  level.inverse.assign(level.size(), 0.0);
  for_each_cell(level.cells, [&](std::size_t number, const GridPlace& cell) {
    double diagonal = level.rest[number];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      diagonal += level.coupling[axis][number];
      const std::int64_t before = neighbour(level.cells, level.periodic, cell, axis, -1);
      if (before >= 0) diagonal += level.coupling[axis][static_cast<std::size_t>(before)];
    }
    if (diagonal > 0) level.inverse[number] = 1 / diagonal;
  });
  for (auto* field : {&level.b, &level.x, &level.residual}) field->assign(level.size(), 0.0);
  find_walls(level);
}

/// Walls with a value leave more of the rows beside them than of those farther inside.
void Multigrid::find_walls(Level& level) {
  std::array<std::array<double, 2>, 3> more{}, couplings{};
  for_each_cell(level.cells, [&](std::size_t number, const GridPlace& cell) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const std::size_t side : {0u, 1u}) {
        const bool is_there = cell[axis] == (side == 0 ? 0 : level.cells[axis] - 1);
        if (!is_there || level.periodic[axis] || level.cells[axis] == 1) continue;
        const std::int64_t inside = neighbour(level.cells, level.periodic, cell, axis, side == 0 ? 1 : -1);
        more[axis][side] += level.rest[number] - level.rest[static_cast<std::size_t>(inside)];
        couplings[axis][side] += level.coupling[axis][side == 0 ? number : static_cast<std::size_t>(inside)];
      }
    }
  });
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const std::size_t side : {0u, 1u}) level.has_value[axis][side] = more[axis][side] > couplings[axis][side] / 2;
  }
}

bool Multigrid::has_coarser(const Level& fine, Level& coarse) {
  std::array<double, 3> strength{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double sum = 0, count = 0;
    for (const double w : fine.coupling[axis]) sum += w, count += w > 0 ? 1 : 0;
    strength[axis] = count > 0 ? sum / count : 0;
  }
  const double strongest = *std::ranges::max_element(strength);
  coarse.cells = fine.cells;
  coarse.periodic = fine.periodic;
  bool any = false;
  std::array<bool, 3> halved{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t n = fine.cells[axis];
    const bool keeps_ring =
        !fine.periodic[axis] || (n % 2 == 0 && n >= 6);  // a ring of two has two ways to a neighbour
    halved[axis] = n > 1 && keeps_ring && strength[axis] > 0 && strength[axis] >= least_coupling * strongest;
    if (halved[axis]) coarse.cells[axis] = (n + 1) / 2;
    any = any || halved[axis];
  }
  if (!any) return false;
  const auto size = static_cast<std::size_t>(coarse.cells[0] * coarse.cells[1] * coarse.cells[2]);
  for (auto& coupling : coarse.coupling) coupling.assign(size, 0.0);
  coarse.rest.assign(size, 0.0);
  for_each_cell(fine.cells, [&](std::size_t number, const GridPlace& cell) {
    GridPlace parent = cell;
    for (std::size_t axis = 0; axis < 3; ++axis) parent[axis] = halved[axis] ? cell[axis] / 2 : cell[axis];
    const std::size_t to = number_of(coarse.cells, parent);
    double inner = fine.rest[number];  // what a cell away from walls has
    bool is_at_wall = false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t next = neighbour(fine.cells, fine.periodic, cell, axis, 1),
                         before = neighbour(fine.cells, fine.periodic, cell, axis, -1);
      const double w = fine.coupling[axis][number];
      const double w_before = before < 0 ? 0 : fine.coupling[axis][static_cast<std::size_t>(before)];
      if (next >= 0 && w > 0 && (!halved[axis] || cell[axis] % 2 == 1 || cell[axis] + 1 == fine.cells[axis]))
        coarse.coupling[axis][to] += halved[axis] ? w / 2 : w;
      if (!halved[axis] || (w > 0) == (w_before > 0)) continue;
      is_at_wall = true;
      inner = std::min(inner, fine.rest[static_cast<std::size_t>(w > 0 ? next : before)]);
    }
    const double wall = is_at_wall ? fine.rest[number] - inner : 0;
    coarse.rest[to] += inner + wall / 2;
  });
  coarse.is_halved = {};
  return true;
}

std::optional<Multigrid> Multigrid::make(Level finest, double sign) {
  Multigrid result;
  result.sign_ = sign;
  set_inverse(finest);
  result.levels_.push_back(std::move(finest));
  while (result.levels_.back().size() > most_of_coarsest) {
    Level coarse;
    if (!has_coarser(result.levels_.back(), coarse)) break;
    for (std::size_t axis = 0; axis < 3; ++axis)
      result.levels_.back().is_halved[axis] = coarse.cells[axis] != result.levels_.back().cells[axis];
    set_inverse(coarse);
    result.levels_.push_back(std::move(coarse));
  }
  Level& last = result.levels_.back();
  if (last.size() > 40 * most_of_coarsest) return std::nullopt;
  const auto size = static_cast<Eigen::Index>(last.size());
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(size, size);
  for_each_cell(last.cells, [&](std::size_t number, const GridPlace& cell) {
    const auto i = static_cast<Eigen::Index>(number);
    dense(i, i) += last.rest[number];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t next = neighbour(last.cells, last.periodic, cell, axis, 1);
      if (next < 0) continue;
      const double w = last.coupling[axis][number];
      const auto j = static_cast<Eigen::Index>(next);
      dense(i, i) += w, dense(j, j) += w, dense(i, j) -= w, dense(j, i) -= w;
    }
  });
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> inverse;
  inverse.setThreshold(1e-10);
  result.coarsest_inverse_ = inverse.compute(dense).pseudoInverse();
  return result;
}

/// x = (b + sum w*x of neighbours)/diagonal in the cells of one colour.
void Multigrid::smooth(Level& level, int colour) {
  const auto [nx, ny, nz] = level.cells;
  const std::int64_t plane = nx * ny;
  const double *wx = level.coupling[0].data(), *wy = level.coupling[1].data(), *wz = level.coupling[2].data();
  const double *b = level.b.data(), *inverse = level.inverse.data();
  double* x = level.x.data();
  for (std::int64_t k = 0; k < nz; ++k) {
    const std::int64_t above = (k + 1 == nz ? -k : 1) * plane, below = (k == 0 ? nz - 1 : -1) * plane;
    for (std::int64_t j = 0; j < ny; ++j) {
      const std::int64_t up = (j + 1 == ny ? -j : 1) * nx, down = (j == 0 ? ny - 1 : -1) * nx;
      const std::int64_t row = j * nx + k * plane, begin = (colour + j + k) & 1;
      const auto at = [&](std::int64_t i, std::int64_t right, std::int64_t left) {
        const std::int64_t c = row + i;
        double sum = b[c] + wx[c] * x[c + right] + wx[c + left] * x[c + left];
        if (ny > 1) sum += wy[c] * x[c + up] + wy[c + down] * x[c + down];
        if (nz > 1) sum += wz[c] * x[c + above] + wz[c + below] * x[c + below];
        x[c] = sum * inverse[c];
      };
      // Beyond bounded ends couplings are 0, so that wrapping reads something and takes nothing of it.
      for (std::int64_t i = begin; i < nx; i += 2) {
        if (i > 0 && i + 1 < nx) {
          at(i, 1, -1);
        } else {
          at(i, i + 1 == nx ? -i : 1, i == 0 ? nx - 1 : -1);
        }
      }
    }
  }
}

void Multigrid::find_residual(Level& level) {
  const auto [nx, ny, nz] = level.cells;
  const std::int64_t plane = nx * ny;
  const double *wx = level.coupling[0].data(), *wy = level.coupling[1].data(), *wz = level.coupling[2].data();
  const double *b = level.b.data(), *rest = level.rest.data(), *x = level.x.data();
  double* r = level.residual.data();
  for (std::int64_t k = 0; k < nz; ++k) {
    const std::int64_t above = (k + 1 == nz ? -k : 1) * plane, below = (k == 0 ? nz - 1 : -1) * plane;
    for (std::int64_t j = 0; j < ny; ++j) {
      const std::int64_t up = (j + 1 == ny ? -j : 1) * nx, down = (j == 0 ? ny - 1 : -1) * nx;
      const std::int64_t row = j * nx + k * plane;
      const auto at = [&](std::int64_t i, std::int64_t right, std::int64_t left) {
        const std::int64_t c = row + i;
        double sum = b[c] - rest[c] * x[c] + wx[c] * (x[c + right] - x[c]) + wx[c + left] * (x[c + left] - x[c]);
        if (ny > 1) sum += wy[c] * (x[c + up] - x[c]) + wy[c + down] * (x[c + down] - x[c]);
        if (nz > 1) sum += wz[c] * (x[c + above] - x[c]) + wz[c + below] * (x[c + below] - x[c]);
        r[c] = sum;
      };
      at(0, nx == 1 ? 0 : 1, nx - 1);
      for (std::int64_t i = 1; i + 1 < nx; ++i) at(i, 1, -1);
      if (nx > 1) at(nx - 1, 1 - nx, -1);
    }
  }
}

namespace {

/// The two coarse cells that a fine one is interpolated from along an axis, and their weights.
struct Between {
  std::int64_t near = 0, far = 0;
  double near_weight = 1, far_weight = 0;
};

}  // namespace

/// Interpolation is linear from cell centre to cell centre. Where there is no second cell the image of the first takes
/// its part: that of a wall with a value has the other sign.
template <class Fine, class F>
static void for_each_weight(const Fine& fine, const std::array<std::int64_t, 3>& coarse, const F& f) {
  std::array<std::vector<Between>, 3> between;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::int64_t i = 0; i < fine.cells[axis]; ++i) {
      Between& one = between[axis].emplace_back(Between{i, i, 1, 0});
      if (!fine.is_halved[axis]) continue;
      one = {i / 2, i / 2 + (i % 2 == 0 ? -1 : 1), 0.75, 0.25};
      if (fine.periodic[axis]) one.far = (one.far + coarse[axis]) % coarse[axis];
      if (one.far >= 0 && one.far < coarse[axis]) continue;
      one = {one.near, one.near, fine.has_value[axis][one.far < 0 ? 0 : 1] ? 0.5 : 1.0, 0};
    }
  }
  std::size_t number = 0;
  for (std::int64_t k = 0; k < fine.cells[2]; ++k) {
    const Between z = between[2][static_cast<std::size_t>(k)];
    for (std::int64_t j = 0; j < fine.cells[1]; ++j) {
      const Between y = between[1][static_cast<std::size_t>(j)];
      const std::array<std::int64_t, 4> rows{
          coarse[0] * (y.near + coarse[1] * z.near), coarse[0] * (y.far + coarse[1] * z.near),
          coarse[0] * (y.near + coarse[1] * z.far), coarse[0] * (y.far + coarse[1] * z.far)};
      const std::array<double, 4> weights{y.near_weight * z.near_weight, y.far_weight * z.near_weight,
                                          y.near_weight * z.far_weight, y.far_weight * z.far_weight};
      for (std::int64_t i = 0; i < fine.cells[0]; ++i, ++number)
        f(number, between[0][static_cast<std::size_t>(i)], rows, weights);
    }
  }
}

void Multigrid::restrict_residual(const Level& fine, Level& coarse) {
  std::ranges::fill(coarse.b, 0.0);
  for_each_weight(fine, coarse.cells, [&](std::size_t number, const Between& x, const auto& rows, const auto& weights) {
    const double r = fine.residual[number];
    for (std::size_t k = 0; k < 4; ++k) {
      if (weights[k] == 0) continue;
      coarse.b[static_cast<std::size_t>(rows[k] + x.near)] += x.near_weight * weights[k] * r;
      coarse.b[static_cast<std::size_t>(rows[k] + x.far)] += x.far_weight * weights[k] * r;
    }
  });
}

void Multigrid::add_correction(Level& fine, const Level& coarse) {
  for_each_weight(fine, coarse.cells, [&](std::size_t number, const Between& x, const auto& rows, const auto& weights) {
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      if (weights[k] == 0) continue;
      sum += weights[k] * (x.near_weight * coarse.x[static_cast<std::size_t>(rows[k] + x.near)] +
                           x.far_weight * coarse.x[static_cast<std::size_t>(rows[k] + x.far)]);
    }
    if (fine.inverse[number] > 0) fine.x[number] += sum;
  });
}

void Multigrid::descend(std::size_t level) {
  Level& here = levels_[level];
  if (level + 1 == levels_.size()) {
    const auto size = static_cast<Eigen::Index>(here.size());
    Eigen::Map<Eigen::VectorXd>(here.x.data(), size).noalias() =
        coarsest_inverse_ * Eigen::Map<const Eigen::VectorXd>(here.b.data(), size);
    return;
  }
  std::ranges::fill(here.x, 0.0);
  smooth(here, 0);
  smooth(here, 1);
  find_residual(here);
  restrict_residual(here, levels_[level + 1]);
  descend(level + 1);
  add_correction(here, levels_[level + 1]);
  smooth(here, is_symmetric_ ? 1 : 0);
  smooth(here, is_symmetric_ ? 0 : 1);
}

void Multigrid::cycle(std::span<const double> b, std::span<double> x) {
  Level& finest = levels_.front();
  for (std::size_t i = 0; i < b.size(); ++i) finest.b[i] = sign_ * b[i];
  descend(0);
  std::ranges::copy(finest.x, x.begin());
}

}  // namespace dpde
