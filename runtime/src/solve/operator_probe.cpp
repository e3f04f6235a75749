// SPDX-License-Identifier: Apache-2.0
#include "solve/operator_probe.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "dpde/runtime/error.h"
#include "solve/axis_colours.h"

namespace dpde {
namespace {

double largest(std::span<const double> values) {
  double most = 0;
  for (const double value : values) most = std::isnan(value) ? value : std::max(most, std::abs(value));
  return most;
}

class Probe {
 public:
  Probe(const LinearImage& image, const std::array<std::int64_t, 3>& cells, const std::array<bool, 3>& periodic,
        const std::array<std::int64_t, 3>& reach)
      : image_(image),
        axes_{AxisColours(cells[0], periodic[0], reach[0]), AxisColours(cells[1], periodic[1], reach[1]),
              AxisColours(cells[2], periodic[2], reach[2])} {
    matrix_.cells = cells;
    matrix_.periodic = periodic;
    size_ = static_cast<size_t>(cells[0] * cells[1] * cells[2]);
    from_.assign(size_, 0.0);
    to_.assign(size_, 0.0);
  }

  StencilMatrix run() {
    for (std::int64_t z = 0; z < axes_[2].count; ++z) {
      for (std::int64_t y = 0; y < axes_[1].count; ++y) {
        for (std::int64_t x = 0; x < axes_[0].count; ++x) take({x, y, z});
      }
    }
    return std::move(matrix_);
  }

 private:
  /// The columns of the cells of one colour.
  void take(const std::array<std::int64_t, 3>& colour) {
    for_each_cell([&](size_t number, const std::array<std::int64_t, 3>& cell) {
      bool is_it = true;
      for (size_t axis = 0; axis < 3; ++axis)
        is_it = is_it && axes_[axis].colour[static_cast<size_t>(cell[axis])] == colour[axis];
      from_[number] = is_it ? 1 : 0;
    });
    image_(from_, to_);
    for_each_cell([&](size_t number, const std::array<std::int64_t, 3>& cell) {
      if (to_[number] == 0) return;
      std::array<int, 3> offset{};
      for (size_t axis = 0; axis < 3; ++axis) {
        offset[axis] = axes_[axis].offset(cell[axis], colour[axis]);
        if (offset[axis] == AxisColours::none) return;  // found out by the check of linearity
      }
      column(offset)[number] = to_[number];
    });
  }

  std::vector<double>& column(const std::array<int, 3>& offset) {
    const auto is_it = [&](const std::array<int, 3>& other) {  // looked for in each cell: == calls memcmp
      return other[0] == offset[0] && other[1] == offset[1] && other[2] == offset[2];
    };
    const auto known = std::ranges::find_if(matrix_.offsets, is_it);
    if (known != matrix_.offsets.end()) return matrix_.values[static_cast<size_t>(known - matrix_.offsets.begin())];
    matrix_.offsets.push_back(offset);
    return matrix_.values.emplace_back(size_, 0.0);
  }

  template <class F>
  void for_each_cell(const F& f) const {
    size_t number = 0;
    const std::array<std::int64_t, 3>& cells = matrix_.cells;
    for (std::int64_t z = 0; z < cells[2]; ++z) {
      for (std::int64_t y = 0; y < cells[1]; ++y) {
        for (std::int64_t x = 0; x < cells[0]; ++x) f(number++, {x, y, z});
      }
    }
  }

  const LinearImage& image_;
  std::array<AxisColours, 3> axes_;
  StencilMatrix matrix_;
  size_t size_ = 0;
  std::vector<double> from_, to_;
};

/// Numbers between -1 and 1 that are the same in each run.
std::vector<double> arbitrary(size_t count) {
  std::vector<double> values(count);
  std::uint64_t state = 0x9e3779b97f4a7c15;
  for (double& value : values) {
    state = state * 6364136223846793005 + 1442695040888963407;
    value = static_cast<double>(state >> 11) * 0x1p-52 - 1;
  }
  return values;
}

/// The image of `factor` times the values.
std::vector<double> image_of(const LinearImage& image, std::span<const double> values, double factor) {
  std::vector<double> scaled(values.begin(), values.end()), made(values.size());
  for (double& value : scaled) value *= factor;
  image(scaled, made);
  return made;
}

/// Which rows are nothing but rounding, as those of differences that cancel: in cells that are cut off from all others,
/// and where an axis has one cell. Rounding is multiplied by powers of two exactly, whatever the size of what cancels,
/// but not by three or five. What an operator makes that is not linear, as min(v, 2), is not: not by all these powers.
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

/// Makes the rows 0 that are nothing but rounding, and those that are no larger; how large that was.
double drop_rounding(const LinearImage& image, StencilMatrix& matrix) {
  const auto size = static_cast<size_t>(matrix.size());
  const std::vector<bool> is_rounding = rows_of_rounding(image, size);
  double level = 0;
  for (size_t row = 0; row < size; ++row) {
    if (is_rounding[row]) level = std::max(level, largest_of_row(matrix, row));
  }
  constexpr double near = 8;  // roundings of neighbouring rows
  for (size_t row = 0; row < size; ++row) {
    if (!is_rounding[row] && largest_of_row(matrix, row) > near * level) continue;
    for (std::vector<double>& column : matrix.values) column[row] = 0;
  }
  return level;
}

/// How far the matrix is from making of arbitrary values what the operator makes.
struct Departure {
  double difference = 0, entry = 0;  // and the largest coefficient
  double allowed = 0;
};

Departure departure_of(const LinearImage& image, const StencilMatrix& matrix, double rounding,
                       const std::string& what) {
  const auto size = static_cast<size_t>(matrix.size());
  const std::vector<double> values = arbitrary(size), made = image_of(image, values, 1);
  std::vector<double> expected(size);
  multiply(matrix, values, expected);
  Departure result;
  for (const std::vector<double>& column : matrix.values) result.entry = std::max(result.entry, largest(column));
  for (size_t i = 0; i < size; ++i) result.difference = std::max(result.difference, std::abs(made[i] - expected[i]));
  if (!std::isfinite(result.entry) || std::isnan(largest(made)))
    throw NotFinite(fmt::format("solve for {}: the operator is not finite", what));
  // Of one that is nothing, as between obstacles that fill all cells, there is no entry to compare rounding with. Where
  // u - dt*f'(U)*u nearly cancels, rounding is that of its terms, which are of the size 1.
  const double of_terms = std::min(64 * rounding, std::sqrt(rounding) * result.entry);
  const double of_entries = 64 * rounding * result.entry * static_cast<double>(matrix.offsets.size() + 1);
  result.allowed = result.entry > 0 ? std::max(of_entries, of_terms) : std::sqrt(rounding);
  return result;
}

void check_zero(const LinearImage& image, size_t size, const std::string& what) {
  const double of_nothing = largest(image_of(image, std::vector<double>(size, 0.0), 1));
  if (std::isnan(of_nothing)) throw NotFinite(fmt::format("solve for {}: the operator is not finite", what));
  if (of_nothing != 0)
    throw Error(ErrorKind::run,
                fmt::format("solve for {}: the operator makes {} of 0, so it is not linear", what, of_nothing));
}

}  // namespace

StencilMatrix probe(const LinearImage& image, const std::array<std::int64_t, 3>& cells,
                    const std::array<bool, 3>& periodic, const std::array<std::int64_t, 3>& reach, double rounding,
                    const std::string& what) {
  StencilMatrix matrix = Probe(image, cells, periodic, reach).run();
  // On so few cells it costs nothing to look for rounding, and differences may cancel in all rows.
  constexpr std::int64_t few = 64;
  if (matrix.size() > 1) check_zero(image, static_cast<size_t>(matrix.size()), what);
  double level = matrix.size() <= few ? drop_rounding(image, matrix) : 0;
  if (matrix.size() <= 1) return matrix;
  Departure departure = departure_of(image, matrix, rounding, what);
  if (departure.difference > departure.allowed && matrix.size() > few) {
    level = drop_rounding(image, matrix);
    departure = departure_of(image, matrix, rounding, what);
  }
  const double of_dropped = 64 * level * static_cast<double>(matrix.offsets.size() + 1);
  if (departure.difference > std::max(departure.allowed, of_dropped))
    throw Error(ErrorKind::run,
                fmt::format("solve for {}: the operator is not linear: what it makes of arbitrary values is {:.3g} "
                            "off, with coefficients up to {:.3g}",
                            what, departure.difference, departure.entry));
  return matrix;
}

}  // namespace dpde
