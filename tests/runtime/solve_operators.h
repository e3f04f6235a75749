// SPDX-License-Identifier: Apache-2.0
// Operators for the tests of linear solvers, and results of their dense pseudo-inverses.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include "solve/matrix/stencil_matrix.h"
#include "support/dense.h"

namespace dpde::test {

enum class Wall { periodic, value, slope };  // half a cell outside
using GridCells = std::array<std::int64_t, 3>;
using Coefficient = std::function<double(std::int64_t cell, std::size_t axis)>;  // between a cell and the next one

/// shift*x - div(k*grad(x)) with cells of width 1/n.
inline StencilMatrix diffusion(const GridCells& cells, const std::array<std::pair<Wall, Wall>, 3>& walls, double shift,
                               const Coefficient& k) {
  StencilMatrix matrix;
  matrix.cells = cells;
  const auto size = static_cast<std::size_t>(matrix.size());
  const auto column = [&](const std::array<int, 3>& offset) -> std::vector<double>& {
    for (std::size_t i = 0; i < matrix.offsets.size(); ++i) {
      if (matrix.offsets[i] == offset) return matrix.values[i];
    }
    matrix.offsets.push_back(offset);
    return matrix.values.emplace_back(size, 0.0);
  };
  for (std::size_t axis = 0; axis < 3; ++axis) matrix.periodic[axis] = walls[axis].first == Wall::periodic;
  column({0, 0, 0}).assign(size, shift);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (cells[axis] == 1 && matrix.periodic[axis]) continue;
    const double n2 = static_cast<double>(cells[axis] * cells[axis]);
    std::size_t number = 0;
    for (std::int64_t z = 0; z < cells[2]; ++z) {
      for (std::int64_t y = 0; y < cells[1]; ++y) {
        for (std::int64_t x = 0; x < cells[0]; ++x, ++number) {
          for (const int step : {1, -1}) {
            std::array<int, 3> offset{};
            offset[axis] = step;
            const std::int64_t other = column_of(matrix, {x, y, z}, offset);
            const auto cell = static_cast<std::int64_t>(number);
            const Wall wall = step > 0 ? walls[axis].second : walls[axis].first;
            if (other < 0 && wall == Wall::slope) continue;
            const double w = k(step > 0 || other < 0 ? cell : other, axis) * n2;
            column({0, 0, 0})[number] += other < 0 ? 2 * w : w;
            if (other >= 0) column(offset)[number] -= w;
          }
        }
      }
    }
  }
  return matrix;
}

inline StencilMatrix transposed(const StencilMatrix& matrix) {
  StencilMatrix result{matrix.cells, matrix.periodic, matrix.offsets, {}};
  result.values.assign(matrix.values.size(), std::vector<double>(static_cast<std::size_t>(matrix.size()), 0.0));
  for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
    for (int& o : result.offsets[k]) o = -o;
    const StencilMatrix one{matrix.cells, matrix.periodic, {matrix.offsets[k]}, {matrix.values[k]}};
    for_each_entry(one, [&](std::size_t, std::size_t column, double value) { result.values[k][column] = value; });
  }
  return result;
}

inline std::vector<double> arbitrary_values(std::int64_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> value(-1, 1);
  std::vector<double> values(static_cast<std::size_t>(count));
  for (double& v : values) v = value(random);
  return values;
}

inline DenseMatrix dense_of(const StencilMatrix& matrix) {
  DenseMatrix dense(matrix.size());
  for_each_entry(matrix, [&](std::size_t row, std::size_t column, double value) { dense(row, column) += value; });
  return dense;
}

/// Largest difference from the result of the dense pseudo-inverse, relative to the largest value.
inline double error_of(const StencilMatrix& matrix, const std::vector<double>& b, const std::vector<double>& x) {
  const std::vector<double> exact = solution(dense_of(matrix), b);
  double difference = 0, largest = 1e-300;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    difference = std::max(difference, std::abs(exact[i] - x[i]));
    largest = std::max(largest, std::abs(exact[i]));
  }
  return difference / largest;
}

inline double constant_one(std::int64_t, std::size_t) { return 1; }
inline double uneven(std::int64_t cell, std::size_t axis) {
  return 1 + 0.5 * std::sin(0.7 * static_cast<double>(cell) + 2 * static_cast<double>(axis));
}

inline const std::vector<std::pair<Wall, Wall>> all_walls{{Wall::periodic, Wall::periodic},
                                                          {Wall::value, Wall::value},
                                                          {Wall::slope, Wall::slope},
                                                          {Wall::value, Wall::slope}};

}  // namespace dpde::test
