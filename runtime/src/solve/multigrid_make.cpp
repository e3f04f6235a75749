// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include "solve/grid_place.h"
#include "solve/multigrid.h"

namespace dpde {
namespace {

constexpr std::size_t most_of_coarsest = 64, most_factored = 20000;
/// Behind red cells and black ones the sum of residuals leaves corrections too small: on 512^2 cells cycles come to
/// 0.16 of what is left, with this factor to 0.10; on 128^3 to 0.21 and 0.18. On the finest level alone, as waves that
/// all levels see would be made too large by its power (over-correction: Mika and Vanek 1992, Braess 1995). Around
/// discs with jumps in long cells it loses: 32 cycles become 48, 62 become 77.
constexpr double over_correction = 1.08;

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

double largest_of(const StencilMatrix& matrix) {
  double largest = 0;
  for (const std::vector<double>& column : matrix.values) {
    for (const double value : column) largest = std::max(largest, std::abs(value));
  }
  return largest;
}

constexpr const char* not_symmetric = "the operator is not symmetric";
constexpr const char* not_neighbours = "cells are coupled with others than their neighbours along the axes";

MultigridLevel empty_level(const std::array<std::int64_t, 3>& cells, const std::array<bool, 3>& periodic) {
  MultigridLevel level;
  level.cells = cells;
  level.periodic = periodic;
  const auto size = static_cast<std::size_t>(cells[0] * cells[1] * cells[2]);
  level.rest.assign(size, 0.0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (cells[axis] == 1) level.periodic[axis] = false;
    level.width[axis].assign(static_cast<std::size_t>(cells[axis]), 1.0);
    level.coupling[axis].assign(size, 0.0);
  }
  return level;
}

/// Couplings of the symmetric part; `rest` has the diagonal.
MultigridLevel level_of(const StencilMatrix& matrix) {
  MultigridLevel level = empty_level(matrix.cells, matrix.periodic);
  for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
    const auto axis = axis_of(matrix.offsets[k]);
    const bool is_diagonal = matrix.offsets[k] == std::array{0, 0, 0};
    if (!axis && !is_diagonal) continue;
    for_each_cell(matrix.cells, [&](std::size_t number, const GridPlace& cell) {
      const double value = matrix.values[k][number];
      if (value == 0) return;
      if (is_diagonal || level.cells[axis->first] == 1) {
        level.rest[number] += value;
        return;
      }
      const std::int64_t other = neighbour(level.cells, level.periodic, cell, axis->first, axis->second);
      if (other < 0) return;
      level.coupling[axis->first][axis->second > 0 ? number : static_cast<std::size_t>(other)] -= value / 2;
    });
  }
  return level;
}

/// The same of rows that are alike: what is beyond a wall is the cell beside it again, or the other way round.
MultigridLevel level_of(const ConstantRows& rows) {
  MultigridLevel level = empty_level(rows.cells(), rows.periodic());
  for (std::size_t k = 0; k < rows.row().size(); ++k) {
    const auto axis = axis_of(rows.offsets()[k]);
    const bool is_diagonal = rows.offsets()[k] == std::array{0, 0, 0};
    const double value = rows.row()[k];
    if (!axis && !is_diagonal) continue;
    for_each_cell(level.cells, [&](std::size_t number, const GridPlace& cell) {
      if (is_diagonal) {
        level.rest[number] += value;
        return;
      }
      const auto [along, step] = *axis;
      const std::int64_t other = neighbour(level.cells, level.periodic, cell, along, step);
      if (other < 0) {
        level.rest[number] += rows.image(along, cell[along] + step).second * value;
      } else {
        level.coupling[along][step > 0 ? number : static_cast<std::size_t>(other)] -= value / 2;
      }
    });
  }
  return level;
}

double largest_of(const ConstantRows& rows) {
  double largest = 0;
  for (const double value : rows.row()) largest = std::max(largest, std::abs(value));
  return largest;
}

/// Makes `rest` what rows sum to, which the sums of couplings and of diagonals have to the last digit of those only.
void take_sums(MultigridLevel& level, const StencilMatrix& matrix) {
  for (std::size_t cell = 0; cell < level.size(); ++cell) {
    double sum = 0;
    for (const std::vector<double>& column : matrix.values) sum += column[cell];
    level.rest[cell] = sum;
  }
}

/// What is beyond a wall with a value is the cell beside it with the other sign.
void take_sums(MultigridLevel& level, const ConstantRows& rows) {
  for_each_cell(level.cells, [&](std::size_t number, const GridPlace& cell) {
    double sum = rows.sum();
    for (std::size_t k = 0; k < rows.row().size(); ++k) {
      const auto axis = axis_of(rows.offsets()[k]);
      if (axis && rows.image(axis->first, cell[axis->first] + axis->second).second < 0) sum -= 2 * rows.row()[k];
    }
    level.rest[number] = sum;
  });
}

/// Of the diagonal in `rest` leaves what couplings do not have.
void take_couplings_away(MultigridLevel& level) {
  for_each_cell(level.cells, [&](std::size_t number, const GridPlace& cell) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      level.rest[number] -= level.coupling[axis][number];
      const std::int64_t before = neighbour(level.cells, level.periodic, cell, axis, -1);
      if (before >= 0) level.rest[number] -= level.coupling[axis][static_cast<std::size_t>(before)];
    }
  });
}

/// Entries of others than neighbours.
bool has_others(const StencilMatrix& matrix) {
  for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
    const bool is_near = matrix.offsets[k] == std::array{0, 0, 0} || axis_of(matrix.offsets[k]);
    if (!is_near && std::ranges::any_of(matrix.values[k], [](double value) { return value != 0; })) return true;
  }
  return false;
}
bool has_others(const ConstantRows& rows) {
  return std::ranges::any_of(rows.offsets(), [](const std::array<int, 3>& offset) {
    return offset != std::array{0, 0, 0} && !axis_of(offset);
  });
}

}  // namespace

template <class Rows>
std::optional<Multigrid> Multigrid::of_all(const Rows& rows, const NullSpace& null_space,
                                           const MultigridOptions& options, std::string& why) {
  why = not_symmetric;
  if (null_space.is_lopsided() || !(options.is_known_symmetric || dpde::is_symmetric(rows, options.rounding)))
    return std::nullopt;
  why = not_neighbours;
  if (has_others(rows)) return std::nullopt;
  MultigridLevel level = level_of(rows);
  take_sums(level, rows);
  return of_level(std::move(level), 0, null_space, options, why);
}

template <class Rows>
std::optional<Multigrid> Multigrid::of_part(const Rows& rows, const NullSpace& null_space,
                                            const MultigridOptions& options, std::string& why) {
  MultigridLevel level = level_of(rows);
  take_couplings_away(level);
  return of_level(std::move(level), 8 * options.rounding * largest_of(rows), null_space, options, why);
}

std::optional<Multigrid> Multigrid::of(const StencilMatrix& matrix, const NullSpace& null_space,
                                       const MultigridOptions& options, std::string& why) {
  return of_all(matrix, null_space, options, why);
}
std::optional<Multigrid> Multigrid::of(const ConstantRows& rows, const NullSpace& null_space,
                                       const MultigridOptions& options, std::string& why) {
  return of_all(rows, null_space, options, why);
}
std::optional<Multigrid> Multigrid::of_symmetric_part(const StencilMatrix& matrix, const NullSpace& null_space,
                                                      const MultigridOptions& options, std::string& why) {
  return of_part(matrix, null_space, options, why);
}
std::optional<Multigrid> Multigrid::of_symmetric_part(const ConstantRows& rows, const NullSpace& null_space,
                                                      const MultigridOptions& options, std::string& why) {
  return of_part(rows, null_space, options, why);
}

std::optional<Multigrid> Multigrid::of_level(MultigridLevel level, double zero, const NullSpace& null_space,
                                             const MultigridOptions& options, std::string& why) {
  why = "around a ring of two cells there are two ways to one neighbour";
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (level.periodic[axis] && level.cells[axis] == 2) return std::nullopt;
  }
  double trace = 0, largest = 0;
  for (const double value : level.rest) trace += value;
  for (const auto& coupling : level.coupling) {
    for (const double w : coupling) trace += 2 * w, largest = std::max(largest, std::abs(w));
  }
  const double sign = trace < 0 ? -1 : 1;
  why = "cells are coupled with their neighbours with both signs";
  for (auto& coupling : level.coupling) {
    for (double& w : coupling) {
      w *= sign;
      if (w < -zero) return std::nullopt;
      w = std::max(w, 0.0);
    }
  }
  const double least = -std::max(8 * zero, 64 * 0x1p-52 * largest);
  bool is_dominant = true;
  for (double& rest : level.rest) {
    is_dominant = is_dominant && sign * rest >= least;
    rest = std::max(sign * rest, 0.0);
  }
  why = "rows are not dominated by their diagonals";
  if (!is_dominant) return std::nullopt;
  for (const auto& part : null_space.parts()) {
    for (const std::uint32_t cell : part) level.rest[cell] = 0;  // rounding has left no more
  }
  std::optional<Multigrid> made = make(std::move(level), sign, options, why);
  if (made) made->know_null_space(null_space);
  return made;
}

/// A level of cycles is made of one of equations, which is then given up: it takes ten times the memory.
void Multigrid::add_level(MultigridLevel level) {
  CycleLevel& packed = levels_.emplace_back(std::move(level), is_symmetric_, smoother_, team_);
  if (levels_.size() == 1) return;
  packed.b = Numbers(packed.size());
  packed.x = Numbers(packed.size());
}

std::optional<Multigrid> Multigrid::make(MultigridLevel finest, double sign, const MultigridOptions& options,
                                         std::string& why) {
  Multigrid result;
  result.team_ = options.team;
  result.sign_ = sign;
  result.is_symmetric_ = options.is_symmetric;
  result.smoother_ = options.smoother;
  complete(finest);
  if (options.smoother == SmootherKind::automatic)
    result.smoother_ = is_uneven(finest) ? SmootherKind::chebyshev : SmootherKind::red_black;
  MultigridLevel level = std::move(finest);
  while (level.size() > most_of_coarsest) {
    MultigridLevel coarse;
    if (!make_coarser(level, coarse, options.is_symmetric)) break;
    level.rest = {};
    complete(coarse);
    find_shares(level, coarse);
    if (!options.is_symmetric && result.levels_.empty()) {
      for (double& share : level.share) share *= over_correction;
    }
    result.add_level(std::move(level));
    level = std::move(coarse);
  }
  why = "the cells are coupled much more along short axes than along long ones, so that there is no small coarse grid";
  if (level.size() > most_factored) return std::nullopt;
  result.coarsest_.emplace(matrix_of(level), level.rest);
  const std::size_t size = level.size();
  result.add_level(std::move(level));
  why = "the factors of the coarsest grid have a zero in their diagonal";
  if (!result.coarsest_->is_there()) return std::nullopt;
  result.coarsest_b_.assign(size, 0.0);
  result.coarsest_x_ = result.coarsest_b_;
  return result;
}

}  // namespace dpde
