// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "solve/fourier/grid_place.h"
#include "solve/multigrid/multigrid.h"

namespace dpde {
namespace {

constexpr std::size_t most_of_coarsest = 64, most_factored = 20000;
/// After red-black smoothing, corrections from the sum of residuals are too small: cycles on 512^2 cells reduce the
/// residual to 0.16, with this factor to 0.10; on 128^3 to 0.21 and 0.18. Only on the finest level, since modes that
/// all levels represent would be amplified by its power (over-correction: Mika and Vanek 1992, Braess 1995). It is
/// worse around discs with jumps in elongated cells: 48 cycles in place of 32, 77 in place of 62.
constexpr double over_correction = 1.08;

/// Axis and direction of an offset; empty if it is not a neighbour's.
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

/// Reuses the memory of `level`.
void clear(MultigridLevel& level, const std::array<std::int64_t, 3>& cells, const std::array<bool, 3>& periodic) {
  level.cells = cells;
  level.periodic = periodic;
  level.has_value = {};
  level.share.clear();
  const auto size = static_cast<std::size_t>(cells[0] * cells[1] * cells[2]);
  level.rest.assign(size, 0.0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (cells[axis] == 1) level.periodic[axis] = false;
    level.width[axis].assign(static_cast<std::size_t>(cells[axis]), 1.0);
    level.coupling[axis].assign(size, 0.0);
    level.from[axis].clear();
  }
}

/// Reads the couplings of the symmetric part; `rest` gets the diagonal.
void read_level(const StencilMatrix& matrix, MultigridLevel& level) {
  clear(level, matrix.cells, matrix.periodic);
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
}

/// The same for constant rows: beyond a wall the adjacent cell is mirrored, evenly or oddly.
void read_level(const ConstantRows& rows, MultigridLevel& level) {
  clear(level, rows.cells(), rows.periodic());
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
}

double largest_of(const ConstantRows& rows) {
  double largest = 0;
  for (const double value : rows.row()) largest = std::max(largest, std::abs(value));
  return largest;
}

/// Sets `rest` to the accurate sums of rows; computed from couplings and diagonals they would only have the latter's
/// accuracy.
void take_sums(MultigridLevel& level, const StencilMatrix& matrix) {
  for (std::size_t cell = 0; cell < level.size(); ++cell) {
    double sum = 0;
    for (const std::vector<double>& column : matrix.values) sum += column[cell];
    level.rest[cell] = sum;
  }
}

/// Beyond a wall with a value is the adjacent cell with the opposite sign.
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

/// Subtracts the couplings from the diagonal in `rest`.
void take_couplings_away(MultigridLevel& level) {
  for_each_cell(level.cells, [&](std::size_t number, const GridPlace& cell) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      level.rest[number] -= level.coupling[axis][number];
      const std::int64_t before = neighbour(level.cells, level.periodic, cell, axis, -1);
      if (before >= 0) level.rest[number] -= level.coupling[axis][static_cast<std::size_t>(before)];
    }
  });
}

/// Whether there are entries of other cells than neighbours.
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

/// Makes the diagonal positive by the factor `sign`, and sets couplings of the other sign to 0 if they are at most
/// `zero`. Returns false if the form is another: `why`.
bool make_positive(MultigridLevel& level, double zero, double& sign, const char*& why) {
  why = "around a ring of two cells there are two ways to one neighbour";
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (level.periodic[axis] && level.cells[axis] == 2) return false;
  }
  double trace = 0, largest = 0;
  for (const double value : level.rest) trace += value;
  for (const auto& coupling : level.coupling) {
    for (const double w : coupling) trace += 2 * w, largest = std::max(largest, std::abs(w));
  }
  sign = trace < 0 ? -1 : 1;
  why = "cells are coupled with their neighbours with both signs";
  for (auto& coupling : level.coupling) {
    for (double& w : coupling) {
      w *= sign;
      if (w < -zero) return false;
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
  return is_dominant;
}

/// Finds a power of two that scales the largest diagonal to about 1. Returns false if other coefficients, or their
/// inverses, then exceed the range of floats; all levels and cycles have similar exponents.
bool find_scale(const MultigridLevel& level, double& scale, const char*& why) {
  constexpr int most_between = 60;  // powers of two, of 126
  int largest = std::numeric_limits<int>::min(), least = std::numeric_limits<int>::max();
  for (const double entry : level.diagonal) {
    if (entry == 0) continue;
    largest = std::max(largest, std::ilogb(entry));
    least = std::min(least, std::ilogb(entry));
  }
  why = "no floats hold both its largest and its smallest diagonals";
  if (largest < least || largest - least > most_between) return false;
  scale = std::ldexp(1.0, -largest);
  return std::isnormal(scale);
}

SmootherKind smoother_for(const MultigridLevel& finest, SmootherKind asked) {
  if (asked != SmootherKind::automatic) return asked;
  return is_uneven(finest) ? SmootherKind::chebyshev : SmootherKind::red_black;
}

/// Reads the finest level into `work`; false: `why`. `is_part`: the symmetric part, with both signs.
template <class Rows>
bool read_finest(const Rows& rows, bool is_part, const NullSpace& null_space, const MultigridOptions& options,
                 MultigridWork& work, const char*& why) {
  if (!is_part) {
    why = not_symmetric;
    if (null_space.is_lopsided() || !(options.is_known_symmetric || dpde::is_symmetric(rows, options.rounding)))
      return false;
    why = not_neighbours;
    if (has_others(rows)) return false;
  }
  read_level(rows, work.level);
  is_part ? take_couplings_away(work.level) : take_sums(work.level, rows);
  if (!make_positive(work.level, is_part ? 8 * options.rounding * largest_of(rows) : 0, work.sign, why)) return false;
  for (const auto& part : null_space.parts()) {
    for (const std::uint32_t cell : part) work.level.rest[cell] = 0;  // only rounding is left
  }
  complete(work.level);
  return true;
}

}  // namespace

template <class Real>
template <class Rows>
std::optional<MultigridOf<Real>> MultigridOf<Real>::made_of(const Rows& rows, bool is_part, const NullSpace& null_space,
                                                            const MultigridOptions& options, std::string& why_not) {
  MultigridOf result;
  const char* why = "";
  result.team_ = options.team;
  result.options_ = options;
  result.is_part_ = is_part;
  MultigridWork work;
  bool has_form = read_finest(rows, is_part, null_space, options, work, why);
  result.sign_ = work.sign;
  if constexpr (has_differences<Real>) has_form = has_form && find_scale(work.level, result.scale_, why);
  if (has_form) result.smoother_ = smoother_for(work.level, options.smoother);
  if (!has_form || !result.set_levels(work, why)) return why_not = why, std::nullopt;
  result.know_null_space(null_space);
  return result;
}

template <class Real>
bool MultigridOf<Real>::renew(const StencilMatrix& matrix, const NullSpace& null_space, bool is_known_symmetric) {
  options_.is_known_symmetric = is_known_symmetric;
  const char* why = "";  // not used: the caller makes another object, which finds it again
  if (work_ == nullptr) work_ = std::make_unique<MultigridWork>();
  if (!read_finest(matrix, is_part_, null_space, options_, *work_, why)) return false;
  if (smoother_for(work_->level, options_.smoother) != smoother_) return false;
  sign_ = work_->sign;
  if constexpr (has_differences<Real>) {
    if (!find_scale(work_->level, scale_, why)) return false;
  }
  if (!set_levels(*work_, why)) return false;
  know_null_space(null_space);
  return true;
}

/// Converts a level of equations to one of cycles. The former takes ten times the memory if coefficients are constant.
template <class Real>
bool MultigridOf<Real>::set_level(std::size_t number, MultigridLevel& level, bool is_new) {
  if (is_new) {
    CycleLevel<Real>& made = levels_.emplace_back(level, smoother_, team_);
    if (number > 0) made.b = NumbersOf<Real>(made.size()), made.x = NumbersOf<Real>(made.size());
  }
  if (number >= levels_.size() || levels_[number].cells() != level.cells) return false;
  if (!levels_[number].has_rings(level.periodic)) return false;
  levels_[number].set(level, scale_, options_.is_symmetric, smoother_, is_new);
  return true;
}

template <class Real>
bool MultigridOf<Real>::set_coarsest(MultigridLevel& level, const char*& why) {
  why = "the cells are coupled much more along short axes than along long ones, so that there is no small coarse grid";
  if (level.size() > most_factored) return false;
  why = "the factors of the coarsest grid have a zero in their diagonal";
  coarsest_b_.assign(level.size(), 0.0);
  coarsest_x_.assign(level.size(), 0.0);
  return coarsest_.set([&](StencilMatrix& matrix) { write_matrix(level, matrix); }, level.rest);
}

template <class Real>
bool MultigridOf<Real>::set_levels(MultigridWork& work, const char*& why) {
  const bool is_new = levels_.empty();
  MultigridLevel *level = &work.level, *coarse = &work.coarse;
  std::size_t number = 0;
  for (; level->size() > most_of_coarsest; ++number) {
    if (!make_coarser(*level, *coarse, options_.is_symmetric)) break;
    if (is_new && !has_differences<Real>) level->rest = {};
    complete(*coarse);
    find_shares(*level, *coarse);
    if (!options_.is_symmetric && number == 0) {
      for (double& share : level->share) share *= over_correction;
    }
    why = "its levels have changed";
    if (!set_level(number, *level, is_new)) return false;
    std::swap(level, coarse);
  }
  const std::size_t count = number + 1;
  return set_coarsest(*level, why) && set_level(number, *level, is_new) && levels_.size() == count;
}

template std::optional<MultigridOf<double>> MultigridOf<double>::made_of(const StencilMatrix&, bool, const NullSpace&,
                                                                         const MultigridOptions&, std::string&);
template std::optional<MultigridOf<double>> MultigridOf<double>::made_of(const ConstantRows&, bool, const NullSpace&,
                                                                         const MultigridOptions&, std::string&);
template std::optional<MultigridOf<float>> MultigridOf<float>::made_of(const StencilMatrix&, bool, const NullSpace&,
                                                                       const MultigridOptions&, std::string&);
template std::optional<MultigridOf<float>> MultigridOf<float>::made_of(const ConstantRows&, bool, const NullSpace&,
                                                                       const MultigridOptions&, std::string&);
template bool MultigridOf<double>::renew(const StencilMatrix&, const NullSpace&, bool);
template bool MultigridOf<float>::renew(const StencilMatrix&, const NullSpace&, bool);

}  // namespace dpde
