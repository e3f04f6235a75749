// SPDX-License-Identifier: Apache-2.0
// The matrix of a linear operator with one or more unknowns a cell, found by applying it to unit vectors of each
// unknown (colours as in operator_probe.h), and its solver. Banded factors if the unknowns of a cell and its neighbours
// can be numbered near each other (always along one axis, and if cells are not coupled); else BiCGStab with incomplete
// factors, or sparse factors if wanted. Everything except sparse factors is allocated once.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "dpde/runtime/cell_colours.h"
#include "solve/matrix/banded.h"
#include "solve/matrix/incomplete_factors.h"
#include "solve/matrix/sparse_factors.h"
#include "solve/operator/krylov.h"

namespace dpde {

/// Applies the operator to interior values of the unknowns, one unknown after the other, x fastest.
using CoupledImage = std::function<void(std::span<const double> values, std::span<double> images)>;

struct CoupledShape {
  std::array<std::int64_t, 3> cells{1, 1, 1};
  std::array<bool, 3> periodic{};
  std::array<std::int64_t, 3> reach{};  // stencil radius; -1: the whole axis
  int unknowns = 1;
};

class CoupledMatrix {
 public:
  enum class Method { automatic, direct, bicgstab };
  CoupledMatrix(const CoupledShape& shape, Method method, double tolerance);

  /// Returns false if the matrix is singular or not finite.
  bool make(const CoupledImage& image);
  /// Returns false if the tolerance is not reached.
  bool solve(std::span<const double> right, std::span<double> x);
  /// Memory use; of factors with fill-in an estimate.
  std::int64_t bytes() const;
  /// Additional memory during construction.
  std::int64_t bytes_of_making() const;
  bool has_factors() const { return band_.has_value() || sparse_ != nullptr; }

 private:
  void number_cells(const CoupledShape& shape);
  std::int64_t widest() const;
  std::vector<std::vector<std::int64_t>> columns_of_rows();
  void set(std::int64_t row, std::int64_t column, double value);
  /// Index of an unknown in the matrix.
  std::int64_t number(std::int64_t cell, int unknown) const {
    return numbers_[static_cast<std::size_t>(cell)] * unknowns_ + unknown;
  }

  int unknowns_ = 1;
  std::int64_t cells_ = 0, entries_ = 0;  // entries_: in the lists of columns, if these were made
  std::vector<CellColour> colours_;
  std::vector<std::int64_t> numbers_;
  std::optional<BandedMatrix> band_;
  std::unique_ptr<SparseFactors> sparse_;  // if factors are wanted and the band is wide
  std::unique_ptr<IncompleteFactors> rows_;
  std::optional<Iterations> iterations_;
  std::vector<double> unit_, image_, right_, solution_;
};

}  // namespace dpde
