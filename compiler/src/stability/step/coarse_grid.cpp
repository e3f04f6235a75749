// SPDX-License-Identifier: Apache-2.0
#include "stability/step/coarse_grid.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace dpde::stability {

namespace {

std::size_t product_of(const std::vector<int>& cells) {
  std::size_t product = 1;
  for (const int n : cells) product *= static_cast<std::size_t>(n);
  return product;
}

/// About half, and even, as axes around a pole must be.
int half_of(int cells) { return (cells + 3) / 4 * 2; }

}  // namespace

CoarseGrid::CoarseGrid(const std::vector<model::Axis>& axes) : CoarseGrid(axes, std::size_t{1} << 18) {}

CoarseGrid CoarseGrid::own(const std::vector<model::Axis>& axes) {
  return {axes, std::numeric_limits<std::size_t>::max()};
}

CoarseGrid::CoarseGrid(const std::vector<model::Axis>& axes, std::size_t most_cells) {
  for (const model::Axis& axis : axes) {
    own_.push_back(axis.cells);
    is_periodic_.push_back(axis.topology == Topology::periodic);
  }
  cells_ = own_;
  while (product_of(cells_) > most_cells) {
    int& longest = *std::ranges::max_element(cells_);
    longest = half_of(longest);
  }
}

std::string CoarseGrid::text() const { return fmt::format("{} cells", fmt::join(cells_, " x ")); }

CoarseGrid::Place CoarseGrid::own_place_of(std::size_t own_cell) const {
  Place place{};
  for (std::size_t a = 0; a < own_.size(); ++a) {
    place[a] = own_cell % static_cast<std::size_t>(own_[a]);
    own_cell /= static_cast<std::size_t>(own_[a]);
  }
  return place;
}

/// Restricts one axis, whose neighbouring cells are `stride` values apart; later axes still have the scene's cells.
std::vector<double> CoarseGrid::restricted_along(std::size_t axis, std::span<const double> values, std::size_t stride,
                                                 bool is_on_faces) const {
  const auto n = static_cast<std::size_t>(cells_[axis]), own = static_cast<std::size_t>(own_[axis]);
  const std::size_t lines = values.size() / (stride * own);
  std::vector<double> result(lines * n * stride, 0.0);
  const auto add = [&](std::size_t cell, std::size_t of_own, double weight) {
    for (std::size_t line = 0; line < lines; ++line) {
      for (std::size_t i = 0; i < stride; ++i)
        result[(line * n + cell) * stride + i] += weight * values[(line * own + of_own) * stride + i];
    }
  };
  if (is_on_faces) {
    for (std::size_t cell = 0; cell < n; ++cell) {  // its face is at (cell + 1)/n of the axis
      const std::size_t place = (cell + 1) * own, above = place / n;
      const double share = static_cast<double>(place % n) / static_cast<double>(n);
      add(cell, above - 1, 1 - share);
      if (share > 0) add(cell, above, share);
    }
    return result;
  }
  for (std::size_t cell = 0; cell < n; ++cell) {  // its length is `own`, in units of 1/n of a scene's cell
    const std::size_t low = cell * own, high = low + own;
    for (std::size_t i = low / n; i * n < high; ++i) {
      const std::size_t common = std::min(high, (i + 1) * n) - std::max(low, i * n);
      add(cell, i, static_cast<double>(common) / static_cast<double>(own));
    }
  }
  return result;
}

std::vector<double> CoarseGrid::restricted(std::span<const double> values, const model::Placement& placement) const {
  std::vector<double> result(values.begin(), values.end());
  std::size_t stride = 1;
  for (std::size_t a = 0; a < own_.size(); ++a) {
    if (cells_[a] != own_[a]) result = restricted_along(a, result, stride, placement[a]);
    stride *= static_cast<std::size_t>(cells_[a]);
  }
  return result;
}

std::vector<double> CoarseGrid::prolonged(std::span<const double> values, const model::Placement& placement) const {
  std::vector<double> result(product_of(own_));
  for (std::size_t own = 0; own < result.size(); ++own) result[own] = at(values, own_place_of(own), placement);
  return result;
}

double CoarseGrid::at(std::span<const double> values, const Place& own_place, const model::Placement& placement) const {
  struct Part {
    std::size_t cell = 0;
    double weight = 1;
  };
  std::array<Part, 8> parts{Part{}};
  std::size_t count = 1, stride = 1;
  for (std::size_t a = 0; a < own_.size(); ++a) {
    const auto n = static_cast<std::size_t>(cells_[a]);
    const double width = static_cast<double>(n) / own_[a];  // of one of the scene's cells
    const double upper = placement[a] ? 1 : 0.5;            // where in a cell its value lies
    const double place = (static_cast<double>(own_place[a]) + upper) * width - upper;
    double below = std::floor(place);
    if (!is_periodic_[a]) below = std::clamp(below, 0.0, std::max(0.0, static_cast<double>(n) - 2));
    const double share = n == 1 ? 0 : place - below;  // weight of the upper cell; extrapolates at walls
    const auto low = static_cast<std::size_t>(below < 0 ? static_cast<double>(n) - 1 : below), high = (low + 1) % n;
    const std::size_t before = count;
    for (std::size_t p = 0; p < before; ++p) {
      if (share != 0) parts[count++] = {parts[p].cell + high * stride, parts[p].weight * share};
      parts[p].cell += low * stride;
      parts[p].weight *= 1 - share;
    }
    stride *= n;
  }
  double sum = 0;
  for (std::size_t p = 0; p < count; ++p) sum += parts[p].weight * values[parts[p].cell];
  return sum;
}

std::size_t CoarseGrid::middle_of(std::size_t cell) const {
  std::size_t own = 0, stride = 1;
  for (std::size_t a = 0; a < own_.size(); ++a) {
    const auto n = static_cast<std::size_t>(cells_[a]), own_n = static_cast<std::size_t>(own_[a]);
    own += (2 * (cell % n) + 1) * own_n / (2 * n) * stride;
    stride *= own_n;
    cell /= n;
  }
  return own;
}

}  // namespace dpde::stability
