// SPDX-License-Identifier: Apache-2.0
#include "solve/operator/operator_probe.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "dpde/runtime/error.h"
#include "solve/operator/box_probe.h"
#include "solve/rows/row_products.h"

namespace dpde {
namespace {

/// On so few cells the test for rounding is cheap, and differences may cancel in all rows.
constexpr std::int64_t few_rows = 64;
/// For boxes of so few cells the search for a pattern, which takes a few applications too, is skipped.
constexpr std::int64_t small_box = 20;
constexpr int comparisons = 2;

double largest(std::span<const double> values) {
  double most = 0;
  for (const double value : values) most = std::isnan(value) ? value : std::max(most, std::abs(value));
  return most;
}

/// Numbers of magnitude 1/2 to 1, the same in each run: a wrong entry shows in its row, whatever its column. Exact in
/// f32; different for each `seed`.
void fill_arbitrary(std::span<double> values, int seed) {
  std::uint64_t state = 0x9e3779b97f4a7c15 + static_cast<std::uint64_t>(seed);
  for (double& value : values) {
    state = state * 6364136223846793005 + 1442695040888963407;
    const double size = 0.5 + static_cast<double>(state >> 45) * 0x1p-20;
    value = (state >> 44 & 1) == 0 ? size : -size;
  }
}

std::vector<double> arbitrary(size_t count) {
  std::vector<double> values(count);
  fill_arbitrary(values, 0);
  return values;
}

/// The operator applied to `factor` times the values.
std::vector<double> image_of(const LinearImage& image, std::span<const double> values, double factor) {
  std::vector<double> scaled(values.begin(), values.end()), made(values.size());
  for (double& value : scaled) value *= factor;
  image(scaled, made);
  return made;
}

/// Finds rows that are only rounding of differences that cancel: isolated cells, and axes with one cell. Rounding
/// scales exactly with powers of two, but not with three or five. Results of a nonlinear operator, such as min(v, 2),
/// do not scale with all these powers of two.
std::vector<bool> rows_of_rounding(const LinearImage& image, size_t size) {
  std::vector<bool> is_rounding(size, false);
  const std::vector<double> values = size == 1 ? std::vector<double>{1.0} : arbitrary(size);
  const std::vector<double> once = image_of(image, values, 1);
  for (const double factor : {3.0, 5.0, 7.0, 11.0, 13.0}) {
    const std::vector<double> made = image_of(image, values, factor);
    for (size_t i = 0; i < size; ++i) {
      const bool is_off = std::abs(made[i] - factor * once[i]) > 1e-3 * std::abs(factor * once[i]);
      is_rounding[i] = is_rounding[i] || is_off;
    }
  }
  for (const double power : {2.0, 4.0, 8.0, 16.0}) {
    const std::vector<double> made = image_of(image, values, power);
    for (size_t i = 0; i < size; ++i) is_rounding[i] = is_rounding[i] && made[i] == power * once[i];
  }
  return is_rounding;
}

double largest_of_row(const StencilMatrix& matrix, size_t row) {
  double most = 0;
  for (const std::vector<double>& column : matrix.values) most = std::max(most, std::abs(column[row]));
  return most;
}

/// Sets rows to 0 that are only rounding, and rows that are no larger; returns the size of the rounding.
double drop_rounding(const LinearImage& image, StencilMatrix& matrix) {
  const auto size = static_cast<size_t>(matrix.size());
  const std::vector<bool> is_rounding = rows_of_rounding(image, size);
  double level = 0;
  for (size_t row = 0; row < size; ++row) {
    if (is_rounding[row]) level = std::max(level, largest_of_row(matrix, row));
  }
  constexpr double near = 8;  // factor by which rounding differs between neighbouring rows
  for (size_t row = 0; row < size; ++row) {
    if (!is_rounding[row] && largest_of_row(matrix, row) > near * level) continue;
    for (std::vector<double>& column : matrix.values) column[row] = 0;
  }
  return level;
}

/// Odd symmetry at the low and the high side.
std::array<bool, 2> has_values(Sides sides) {
  return {sides == Sides::odd_even || sides == Sides::odd_odd, sides == Sides::even_odd || sides == Sides::odd_odd};
}

/// Whether unit vectors can be far apart and far from walls.
bool has_room(const std::array<std::int64_t, 3>& cells, const std::array<std::int64_t, 3>& reach) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (reach[axis] < 0 || (reach[axis] > 0 && cells[axis] <= 4 * reach[axis] + 1)) return false;
  }
  return true;
}

}  // namespace

OperatorProbe::OperatorProbe(const std::array<std::int64_t, 3>& cells, const std::array<bool, 3>& periodic,
                             const std::array<std::int64_t, 3>& reach, double rounding, std::string what,
                             const OperatorKnowledge& known)
    : cells_(cells), reach_(reach), periodic_(periodic), rounding_(rounding), what_(std::move(what)), known_(known) {}

/// Applies the operator to `values_`.
void OperatorProbe::make(const LinearImage& image) {
  ++images_;
  image(values_, image_);
}

void OperatorProbe::take_memory(const ProbeRoom& room) {
  values_ = room.values;
  image_ = room.image;
  if (values_.empty()) {
    own_.resize(2 * cell_count());
    values_ = std::span(own_).first(cell_count());
    image_ = std::span(own_).last(cell_count());
  }
  std::ranges::fill(values_, 0.0);
  images_ = 0;
}

void OperatorProbe::drop_memory() {
  values_ = image_ = {};
  own_ = std::vector<double>();
}

GridOperator OperatorProbe::find(const LinearImage& image, GridOperator used, const ProbeRoom& room) {
  take_memory(room);
  if (const ConstantRows* const rows = constant_rows(image)) {
    drop_memory();
    return GridOperator(*rows, known_);
  }
  StencilMatrix matrix = found(image, std::move(used).take_matrix());
  used.set(
      std::move(matrix), [&](const StencilMatrix& of) { return sums_of(of, image); }, rounding_, known_,
      of_null_space_);
  drop_memory();
  if (room.values.empty()) of_null_space_ = {};
  return used;
}

StencilMatrix OperatorProbe::matrix(const LinearImage& image, StencilMatrix used) {
  take_memory({});
  StencilMatrix matrix = found(image, std::move(used));
  drop_memory();
  return matrix;
}

const std::array<AxisColours, 3>& OperatorProbe::colours() {
  if (!colours_) colours_ = BoxShape{cells_, periodic_, reach_}.colours();
  return *colours_;
}

LinearImage OperatorProbe::counted(const LinearImage& image) {
  return [this, &image](std::span<const double> values, std::span<double> made) {
    ++images_;
    image(values, made);
  };
}

/// Computed in the memory of images.
std::span<const double> OperatorProbe::sums_of(const StencilMatrix& matrix, const LinearImage& image) {
  if (known_.takes_constants_to_zero) {
    std::ranges::fill(image_, 0.0);
  } else {
    row_sums(counted(image), matrix, rounding_, values_, image_, doubtful_);
  }
  return image_;
}

/// If the rows are constant, the column of a cell in the middle is the mirrored row of every cell.
const ConstantRows* OperatorProbe::constant_rows(const LinearImage& image) {
  if (static_cast<std::int64_t>(cell_count()) <= few_rows || !has_room(cells_, reach_)) return nullptr;
  const GridPlace middle{cells_[0] / 2, cells_[1] / 2, cells_[2] / 2};
  values_[number_of(cells_, middle)] = 1;
  make(image);
  values_[number_of(cells_, middle)] = 0;
  candidate_.clear(cells_);
  for_each_cell({2 * reach_[0] + 1, 2 * reach_[1] + 1, 2 * reach_[2] + 1}, [&](std::size_t, const GridPlace& in_box) {
    std::array<int, 3> offset{};
    GridPlace cell{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      offset[axis] = static_cast<int>(reach_[axis] - in_box[axis]);
      cell[axis] = middle[axis] - offset[axis];
    }
    const double value = image_[number_of(cells_, cell)];
    if (value != 0) candidate_.add(offset, value);
  });
  if (candidate_.row().empty() || !std::isfinite(largest(candidate_.row()))) return nullptr;
  const std::optional<std::array<Sides, 3>> sides = find_sides(image, candidate_);
  if (!sides) return nullptr;
  candidate_.take_sides(*sides);
  if (!is_made_by(candidate_, image)) return nullptr;
  const std::optional<double> sum = sum_of(candidate_, image);
  if (!sum || !have_one_moment(candidate_, *sum, image)) return nullptr;
  candidate_ = candidate_.with_sum(*sum);
  return &candidate_;
}

/// Finds the symmetry of each wall, even or odd, from the entries among cells next to its middle: the closer one. Empty
/// if rows are not even along an axis with walls.
std::optional<std::array<Sides, 3>> OperatorProbe::find_sides(const LinearImage& image, const ConstantRows& row) {
  std::array<Sides, 3> sides{};
  std::array<bool, 3> is_bounded{};
  const GridPlace middle{cells_[0] / 2, cells_[1] / 2, cells_[2] / 2};
  const auto at = [&](std::size_t axis, std::int64_t place) {
    GridPlace cell = middle;
    cell[axis] = place;
    return number_of(cells_, cell);
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    is_bounded[axis] = !periodic_[axis] && cells_[axis] > 1;
    std::array<bool, 3> mirrored{};
    mirrored[axis] = is_bounded[axis];
    if (!row.is_even(mirrored, difference_of_same_rows * row.row_size())) return std::nullopt;
    if (is_bounded[axis]) values_[at(axis, 0)] = values_[at(axis, cells_[axis] - 1)] = 1;
  }
  if (!is_bounded[0] && !is_bounded[1] && !is_bounded[2]) return sides;
  make(image);
  std::ranges::fill(values_, 0.0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!is_bounded[axis]) continue;
    std::array<bool, 2> is_odd{};
    for (const std::size_t side : {0u, 1u}) {
      double of_even = 0, of_odd = 0;
      for (int i = 0; i < std::max<std::int64_t>(reach_[axis], 1); ++i) {
        std::array<int, 3> offset{}, beyond{};
        offset[axis] = i;
        beyond[axis] = i + 1;
        const double made = image_[at(axis, side == 0 ? i : cells_[axis] - 1 - i)] - row.entry(offset);
        of_even = std::max(of_even, std::abs(made - row.entry(beyond)));
        of_odd = std::max(of_odd, std::abs(made + row.entry(beyond)));
      }
      is_odd[side] = of_odd < of_even;
    }
    sides[axis] =
        is_odd[0] ? (is_odd[1] ? Sides::odd_odd : Sides::odd_even) : (is_odd[1] ? Sides::even_odd : Sides::even_even);
  }
  return sides;
}

bool OperatorProbe::is_made_by(const ConstantRows& rows, const LinearImage& image) {
  std::ranges::fill(values_, 0.0);
  make(image);
  if (largest(image_) != 0) return false;  // or NaN
  for (int turn = 0; turn < comparisons; ++turn) {
    fill_arbitrary(values_, turn);
    make(image);
    const double off = largest_residual(rows, image_, values_);
    if (!(off <= 64 * rounding_ * rows.row_size())) return false;
  }
  return true;
}

/// In f32, rounding in images of arbitrary values hides a k of less than 60 in lap(p) - k*p on 1024^2 cells, and a wall
/// with flux. The image of ones is exact for differences; for constant rows it is the same in all cells, except next to
/// walls with a value. Otherwise returns nothing.
std::optional<double> OperatorProbe::sum_of(const ConstantRows& rows, const LinearImage& image) {
  if (known_.takes_constants_to_zero) return 0;
  std::ranges::fill(values_, 1.0);
  make(image);
  const std::size_t middle = number_of(cells_, {cells_[0] / 2, cells_[1] / 2, cells_[2] / 2});
  const double sum = image_[middle];
  const double zero = std::max(4 * rounding_ * std::abs(sum), difference_of_same_rows * rows.row_size());
  bool are_same = true;
  for_each_cell(cells_, [&](std::size_t number, const GridPlace& cell) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto [low, high] = has_values(rows.sides()[axis]);
      if ((low && cell[axis] < reach_[axis]) || (high && cell[axis] >= cells_[axis] - reach_[axis])) return;
    }
    are_same = are_same && std::abs(image_[number] - sum) <= zero;
  });
  if (!are_same) return std::nullopt;
  return row_sum(counted(image), rows, middle, sum, rounding_, values_, image_);
}

/// The same for advection, whose image of arbitrary values is smaller than that of diffusion by the cell size. Uses the
/// image of the cell indices along each axis, whose differences are exact too. Not needed for f64, where nothing is
/// hidden.
bool OperatorProbe::have_one_moment(const ConstantRows& rows, double sum, const LinearImage& image) {
  if (rounding_ < 0x1p-30 || !known_.has_coefficients) return true;
  bool are_same = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (cells_[axis] == 1) continue;
    const std::int64_t middle = cells_[axis] / 2;
    for_each_cell(cells_, [&](std::size_t number, const GridPlace& cell) {
      values_[number] = static_cast<double>(cell[axis] - middle);
    });
    make(image);
    const double moment = image_[number_of(cells_, {cells_[0] / 2, cells_[1] / 2, cells_[2] / 2})];
    for_each_cell(cells_, [&](std::size_t number, const GridPlace& cell) {
      for (std::size_t other = 0; other < 3; ++other) {
        const bool is_alike = other != axis && rows.sides()[other] == Sides::periodic;
        if (!is_alike && (cell[other] < reach_[other] || cell[other] >= cells_[other] - reach_[other])) return;
      }
      const double expected = sum * static_cast<double>(cell[axis] - middle) + moment;
      const double size = std::abs(sum) * static_cast<double>(middle) + std::abs(moment);
      const double zero = std::max(16 * rounding_ * size, difference_of_same_rows * rows.row_size());
      are_same = are_same && std::abs(image_[number] - expected) <= zero;
    });
  }
  return are_same;
}

void OperatorProbe::check_zero(const LinearImage& image) {
  std::ranges::fill(values_, 0.0);
  make(image);
  const double of_nothing = largest(image_);
  if (std::isnan(of_nothing)) throw NotFinite(fmt::format("solve for {}: the operator is not finite", what_));
  if (of_nothing != 0)
    throw Error(ErrorKind::run,
                fmt::format("solve for {}: the operator makes {} of 0, so it is not linear", what_, of_nothing));
}

/// Largest difference between matrix and operator on arbitrary values.
OperatorProbe::Departure OperatorProbe::departure_of(const LinearImage& image, const StencilMatrix& matrix) {
  Departure result;
  for (const std::vector<double>& column : matrix.values) result.entry = std::max(result.entry, largest(column));
  for (int turn = 0; turn < comparisons; ++turn) {
    fill_arbitrary(values_, turn);
    make(image);
    if (!std::isfinite(result.entry) || std::isnan(largest(image_)))
      throw NotFinite(fmt::format("solve for {}: the operator is not finite", what_));
    result.difference = std::max(result.difference, largest_residual(matrix, image_, values_));
  }
  // A zero operator, as between obstacles that fill all cells, has no entry to compare rounding with. If u - dt*f'(U)*u
  // nearly cancels, rounding is that of its terms, which are of size 1.
  const double of_terms = std::min(64 * rounding_, std::sqrt(rounding_) * result.entry);
  const double of_entries = 64 * rounding_ * result.entry * static_cast<double>(matrix.offsets.size() + 1);
  result.allowed = result.entry > 0 ? std::max(of_entries, of_terms) : std::sqrt(rounding_);
  return result;
}

/// Finds a stencil with few entries in its box by its pattern; returns false if entries are outside of it: use boxes
/// then.
bool OperatorProbe::is_by_pattern(const LinearImage& image, StencilMatrix& matrix) {
  BoxProbe boxes(image, {cells_, periodic_, reach_}, colours(), values_, image_);
  if (boxes.count() <= small_box) return false;
  pattern_.offsets = boxes.some_offsets(std::move(pattern_.offsets));
  images_ += BoxProbe::images_of_some;
  if (pattern_.known != pattern_.offsets) {
    pattern_.known = pattern_.offsets;
    const auto entries = static_cast<std::int64_t>(pattern_.offsets.size());
    pattern_.colours.reset();
    if (entries > 0 && 2 * entries < boxes.count())
      pattern_.colours = PatternColours::of(pattern_.offsets, cells_, periodic_, boxes.count() / 2);
  }
  if (!pattern_.colours) return false;
  matrix.cells = cells_;
  matrix.periodic = periodic_;
  matrix.offsets = pattern_.colours->offsets();
  matrix.values.resize(matrix.offsets.size());
  for (std::vector<double>& column : matrix.values) column.assign(cell_count(), 0.0);
  bool is_all = true;
  for (std::int64_t colour = 0; is_all && colour < pattern_.colours->count(); ++colour) {
    for_each_cell(cells_, [&](std::size_t number, const GridPlace& cell) {
      values_[number] = pattern_.colours->colour(cell) == colour ? 1 : 0;
    });
    make(image);
    for_each_cell(cells_, [&](std::size_t number, const GridPlace& cell) {
      if (image_[number] == 0) return;
      const int k = pattern_.colours->entry(cell, colour);
      is_all = is_all && k >= 0;
      if (k >= 0) matrix.values[static_cast<std::size_t>(k)][number] = image_[number];
    });
  }
  if (is_all) {
    const Departure departure = departure_of(image, matrix);
    is_all = departure.difference <= departure.allowed;
  }
  return is_all;
}

StencilMatrix OperatorProbe::found(const LinearImage& image, StencilMatrix used) {
  std::ranges::fill(values_, 0.0);
  images_ = 0;
  const auto cells = static_cast<std::int64_t>(cell_count());
  if (cells > few_rows) {
    check_zero(image);
    if (is_by_pattern(image, used)) return used;
  }
  BoxProbe boxes(image, {cells_, periodic_, reach_}, colours(), values_, image_, std::move(used));
  StencilMatrix matrix = boxes.all();
  images_ += static_cast<int>(boxes.count());
  if (cells > 1 && cells <= few_rows) check_zero(image);
  double level = cells <= few_rows ? drop_rounding(image, matrix) : 0;
  if (cells <= 1) return matrix;
  Departure departure = departure_of(image, matrix);
  if (departure.difference > departure.allowed && cells > few_rows) {
    level = drop_rounding(image, matrix);
    departure = departure_of(image, matrix);
  }
  const double of_dropped = 64 * level * static_cast<double>(matrix.offsets.size() + 1);
  if (departure.difference > std::max(departure.allowed, of_dropped))
    throw Error(ErrorKind::run,
                fmt::format("solve for {}: the operator is not linear: what it makes of arbitrary values is {:.3g} "
                            "off, with coefficients up to {:.3g}",
                            what_, departure.difference, departure.entry));
  return matrix;
}

}  // namespace dpde
