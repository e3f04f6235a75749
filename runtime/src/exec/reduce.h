// SPDX-License-Identifier: Apache-2.0
// Reductions over axes, resolved for one layout: the mean, sum, maximum or minimum of a field over each line, plane or
// grid along these axes, stored in all of its cells.
//
// Values are combined in f64, in an order that does not depend on the number of threads: along x in lanes of a row,
// then across rows, then across subgrids.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/communicator.h"
#include "dpde/runtime/team.h"

namespace dpde {

class FieldReduction {
 public:
  FieldReduction() = default;
  /// `ranks`: for a subgrid; must outlive the object.
  FieldReduction(const dpde_reduce& reduce, const dpde_layout& layout, const Team& team, Communicator* ranks = nullptr);

  /// `fields` point at their cells (0,0,0). Allocates nothing.
  void run(void* const* fields);

 private:
  template <class Real, class Combine>
  void reduce(const Real* from, Real* to, double first, const Combine& combine);
  template <class Real, class Combine>
  void reduce_rows(const Real* from, Real* to, double first, const Combine& combine);
  template <class Real, class Combine>
  void reduce_across_rows(const Real* from, Real* to, double first, const Combine& combine);
  template <class Combine>
  void combine_rows(double first, const Combine& combine);
  void meet();
  bool over(std::size_t axis) const { return reduce_.over[axis] != 0; }
  /// Number of lines, planes or grids along an axis, and number of rows of each along it.
  int64_t groups(std::size_t axis) const { return over(axis) ? 1 : cells_[axis]; }
  int64_t length(std::size_t axis) const { return over(axis) ? cells_[axis] : 1; }
  double finished(double value) const { return reduce_.kind == DPDE_MEAN ? value / count_ : value; }

  dpde_reduce reduce_{};
  int32_t real_ = DPDE_F64;
  Team team_;
  int64_t piece_ = 1;  // cells of a row that are combined across rows in one go
  double count_ = 1;   // cells that are reduced to one value
  std::array<int64_t, 3> cells_{1, 1, 1}, stride_{};
  std::vector<double> rows_;       // if x is reduced: the value of each row
  Communicator* ranks_ = nullptr;  // if a reduced axis is divided
  std::vector<double> values_;     // exchanged between ranks, one a cell or a row of the result
};

}  // namespace dpde
