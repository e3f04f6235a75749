// SPDX-License-Identifier: Apache-2.0
#include "solve/multigrid/multigrid_level.h"

#include <algorithm>
#include <cmath>

#include "solve/fourier/grid_place.h"

namespace dpde {
namespace {

constexpr double least_coupling = 0.25;  // relative to the strongest axis
constexpr double least_even = 0.5;       // likewise
constexpr double largest_change = 10;    // factor between successive couplings

/// Finds walls with a value: rows next to them sum to more than rows farther inside.
void find_walls(MultigridLevel& level) {
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

/// The mean coupling along each axis.
std::array<double, 3> strengths(const MultigridLevel& level) {
  std::array<double, 3> strength{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double sum = 0, count = 0;
    for (const double w : level.coupling[axis]) sum += w, count += w > 0 ? 1 : 0;
    strength[axis] = count > 0 ? sum / count : 0;
  }
  return strength;
}

/// The axes to coarsen.
std::array<bool, 3> halved_axes(const MultigridLevel& fine) {
  const std::array<double, 3> strength = strengths(fine);
  const double strongest = *std::ranges::max_element(strength);
  std::array<bool, 3> halved{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t least = fine.periodic[axis] ? 3 : 2;
    halved[axis] = fine.cells[axis] >= least && strength[axis] > 0 && strength[axis] >= least_coupling * strongest;
  }
  return halved;
}

/// Whether couplings vary from cell to cell by more than linear interpolation between coarse cells can follow.
bool has_jumps(const MultigridLevel& level) {
  bool found = false;
  for_each_cell(level.cells, [&](std::size_t number, const GridPlace& cell) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t before = neighbour(level.cells, level.periodic, cell, axis, -1);
      if (before < 0) continue;
      const auto [less, more] =
          std::minmax(level.coupling[axis][number], level.coupling[axis][static_cast<std::size_t>(before)]);
      found = found || (less > 0 && more > largest_change * less);
    }
  });
  return found;
}

/// The fine cell lies t away from the centre of its coarse cell. If there is no second coarse cell on that side, the
/// mirror image of the first replaces it, with the opposite sign at a wall with a value. Without `is_linear` a fine
/// cell gets the value of its coarse cell.
void interpolate(MultigridLevel& fine, const MultigridLevel& coarse, std::size_t axis, bool is_symmetric,
                 bool is_linear) {
  AxisInterpolation& result = fine.from[axis];
  result.clear();
  result.is_halved = true;
  const std::vector<double>&width = fine.width[axis], &coarse_width = coarse.width[axis];
  const std::int64_t n = fine.cells[axis], half = coarse.cells[axis];
  for (auto& weights : result.weights) weights.assign(static_cast<std::size_t>(half), 0.0);
  const auto give = [&](std::int64_t from, std::int64_t to, double weight) {
    if (weight == 0) return;
    std::int64_t place = to - 2 * from + 1;
    if (fine.periodic[axis]) place = place < 0 ? place + n : place > 3 ? place - n : place;
    result.weights[static_cast<std::size_t>(place)][static_cast<std::size_t>(from)] += weight;
  };
  for (std::int64_t i = 0; i < n; ++i) {
    const std::int64_t near = i / 2;
    const double whole = coarse_width[static_cast<std::size_t>(near)];
    const double t = (whole - width[static_cast<std::size_t>(i)]) / 2;
    std::int64_t far = near + (i % 2 == 0 ? -1 : 1);
    double near_weight = 1, far_weight = 0;
    if (fine.periodic[axis]) far = (far + half) % half;
    if (!is_linear) {
      far = near;
    } else if (far < 0 || far >= half) {
      near_weight = fine.has_value[axis][far < 0 ? 0 : 1] ? 1 - 2 * t / whole : 1;
      far = near;
    } else {
      far_weight = t / ((whole + coarse_width[static_cast<std::size_t>(far)]) / 2);
      near_weight = 1 - far_weight;
    }
    result.near.push_back(static_cast<std::uint32_t>(near));
    result.far.push_back(static_cast<std::uint32_t>(far));
    result.near_weight.push_back(near_weight);
    result.far_weight.push_back(far_weight);
    give(near, i, is_symmetric ? near_weight : 1);
    give(far, i, is_symmetric ? far_weight : 0);
  }
}

void do_not_interpolate(AxisInterpolation& result, std::int64_t cells) {
  result.clear();
  for (std::int64_t i = 0; i < cells; ++i) result.near.push_back(static_cast<std::uint32_t>(i));
  result.far = result.near;
  result.near_weight.assign(result.near.size(), 1.0);
  result.far_weight.assign(result.near.size(), 0.0);
}

/// Adds a fine cell's couplings and rest to those of its coarse cell.
void add_cell(const MultigridLevel& fine, MultigridLevel& coarse, const std::array<bool, 3>& halved, std::size_t number,
              const GridPlace& cell) {
  GridPlace parent = cell;
  for (std::size_t axis = 0; axis < 3; ++axis) parent[axis] = halved[axis] ? cell[axis] / 2 : cell[axis];
  const std::size_t to = number_of(coarse.cells, parent);
  double inner = fine.rest[number], nearer = 1;  // rest of a cell away from walls; factor by which walls are nearer
  bool is_at_wall = false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t next = neighbour(fine.cells, fine.periodic, cell, axis, 1),
                       before = neighbour(fine.cells, fine.periodic, cell, axis, -1);
    const double w = fine.coupling[axis][number];
    const double w_before = before < 0 ? 0 : fine.coupling[axis][static_cast<std::size_t>(before)];
    const auto width = [&](const MultigridLevel& level, std::int64_t i) {
      return level.width[axis][static_cast<std::size_t>(i % level.cells[axis])];
    };
    const bool crosses = !halved[axis] || cell[axis] % 2 == 1 || cell[axis] + 1 == fine.cells[axis];
    if (next >= 0 && w > 0 && crosses) {
      const double way = width(fine, cell[axis]) + width(fine, cell[axis] + 1),
                   coarse_way = width(coarse, parent[axis]) + width(coarse, parent[axis] + 1);
      coarse.coupling[axis][to] += w * way / coarse_way;
    }
    if (!halved[axis] || (w > 0) == (w_before > 0)) continue;
    is_at_wall = true;
    nearer = std::min(nearer, width(fine, cell[axis]) / width(coarse, parent[axis]));
    inner = std::min(inner, fine.rest[static_cast<std::size_t>(w > 0 ? next : before)]);
  }
  const double wall = is_at_wall ? fine.rest[number] - inner : 0;
  coarse.rest[to] += inner + wall * nearer;
}

}  // namespace

void AxisInterpolation::clear() {
  is_halved = false;
  near.clear();
  far.clear();
  near_weight.clear();
  far_weight.clear();
  for (auto& one : weights) one.clear();
}

/// Coarse cells without an equation, inside obstacles, have no correction: the others' weights are scaled up. Fine
/// cells without an equation take none, so their transpose, restriction, is 0 too.
void find_shares(MultigridLevel& fine, const MultigridLevel& coarse) {
  fine.share.assign(fine.size(), 1.0);
  const auto has_equation = [](double diagonal) { return diagonal > 0; };
  if (std::ranges::all_of(fine.diagonal, has_equation) && std::ranges::all_of(coarse.diagonal, has_equation)) return;
  for_each_cell(fine.cells, [&](std::size_t number, const GridPlace& cell) {
    double all = 0, found = 0;
    for (int corner = 0; corner < 8; ++corner) {
      GridPlace place{};
      double weight = 1;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const AxisInterpolation& from = fine.from[axis];
        const auto i = static_cast<std::size_t>(cell[axis]);
        const bool is_far = corner >> axis & 1;
        place[axis] = is_far ? from.far[i] : from.near[i];
        weight *= is_far ? from.far_weight[i] : from.near_weight[i];
      }
      all += weight;
      if (coarse.diagonal[number_of(coarse.cells, place)] > 0) found += weight;
    }
    if (fine.diagonal[number] == 0) {
      fine.share[number] = 0;
    } else if (found > 0) {
      fine.share[number] = all / found;
    }
  });
}

void complete(MultigridLevel& level) {
  level.diagonal.assign(level.size(), 0.0);
  for_each_cell(level.cells, [&](std::size_t number, const GridPlace& cell) {
    double diagonal = level.rest[number];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      diagonal += level.coupling[axis][number];
      const std::int64_t before = neighbour(level.cells, level.periodic, cell, axis, -1);
      if (before >= 0) diagonal += level.coupling[axis][static_cast<std::size_t>(before)];
    }
    level.diagonal[number] = diagonal;
  });
  find_walls(level);
}

bool make_coarser(MultigridLevel& fine, MultigridLevel& coarse, bool is_symmetric) {
  const std::array<bool, 3> halved = halved_axes(fine);
  if (!halved[0] && !halved[1] && !halved[2]) return false;
  coarse.cells = fine.cells;
  coarse.periodic = fine.periodic;
  coarse.width = fine.width;
  const bool is_linear = !is_symmetric || !has_jumps(fine);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (halved[axis]) {
      coarse.cells[axis] = (fine.cells[axis] + 1) / 2;
      coarse.width[axis].assign(static_cast<std::size_t>(coarse.cells[axis]), 0.0);
      for (std::size_t i = 0; i < fine.width[axis].size(); ++i) coarse.width[axis][i / 2] += fine.width[axis][i];
    }
    halved[axis] ? interpolate(fine, coarse, axis, is_symmetric, is_linear)
                 : do_not_interpolate(fine.from[axis], fine.cells[axis]);
  }
  const auto size = static_cast<std::size_t>(coarse.cells[0] * coarse.cells[1] * coarse.cells[2]);
  for (auto& coupling : coarse.coupling) coupling.assign(size, 0.0);
  coarse.rest.assign(size, 0.0);
  coarse.share.clear();
  for (AxisInterpolation& from : coarse.from) from.clear();
  for_each_cell(fine.cells,
                [&](std::size_t number, const GridPlace& cell) { add_cell(fine, coarse, halved, number, cell); });
  return true;
}

double least_share(const MultigridLevel& level) {
  const std::array<double, 3> strength = strengths(level);
  const double all = strength[0] + strength[1] + strength[2];
  double least = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (level.from[axis].is_halved) least = std::min(least, strength[axis] / all);
  }
  return least;
}

std::optional<std::array<double, 3>> even_couplings(const MultigridLevel& level) {
  std::array<double, 3> found{};
  for (std::size_t axis = 0; axis < 3; ++axis) found[axis] = level.coupling[axis].front();
  bool are_even = true;
  for_each_cell(level.cells, [&](std::size_t number, const GridPlace& cell) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool is_end = !level.periodic[axis] && cell[axis] + 1 == level.cells[axis];
      are_even = are_even && level.coupling[axis][number] == (is_end ? 0 : found[axis]);
    }
  });
  return are_even ? std::optional(found) : std::nullopt;
}

bool is_uneven(const MultigridLevel& level) {
  const std::array<double, 3> strength = strengths(level);
  const double strongest = *std::ranges::max_element(strength);
  return std::ranges::any_of(strength, [&](double one) { return one > 0 && one < least_even * strongest; });
}

void write_matrix(const MultigridLevel& level, StencilMatrix& matrix) {
  matrix.cells = level.cells;
  matrix.periodic = level.periodic;
  matrix.offsets.clear();
  const auto next_column = [&](const std::array<int, 3>& offset) -> std::vector<double>& {
    matrix.offsets.push_back(offset);
    if (matrix.values.size() < matrix.offsets.size()) matrix.values.emplace_back();
    return matrix.values[matrix.offsets.size() - 1];
  };
  next_column({0, 0, 0}) = level.diagonal;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (level.cells[axis] == 1) continue;
    std::array<int, 3> offset{};
    for (const int step : {1, -1}) {
      offset[axis] = step;
      std::vector<double>& values = next_column(offset);
      values.assign(level.size(), 0.0);
      for_each_cell(level.cells, [&](std::size_t number, const GridPlace& cell) {
        const std::int64_t other = neighbour(level.cells, level.periodic, cell, axis, step);
        if (other >= 0) values[number] = -level.coupling[axis][step > 0 ? number : static_cast<std::size_t>(other)];
      });
    }
  }
  matrix.values.resize(matrix.offsets.size());
}

}  // namespace dpde
