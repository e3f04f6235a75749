// SPDX-License-Identifier: Apache-2.0
// What solves of a program have in common: values of fields in rows one behind the other, and whether the operator has
// changed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/team.h"

namespace dpde {

/// The layout with one cell along axes that it has not.
dpde_layout with_three_axes(dpde_layout layout);
std::size_t cells_of(const dpde_layout& layout);
/// Of its numbers, relative.
double rounding_of(const dpde_layout& layout);

/// Periodic where a fill of the operator says so: that of an unknown, or any other.
std::array<bool, 3> periodic_axes(const dpde_solve& solve, const dpde_layout& layout);

/// Whole rows of the interior, x fastest, from the cell `first` on. `base` points at the cell (0,0,0).
template <class Value>
void read_rows(const dpde_layout& layout, const void* base, std::int64_t first, std::span<Value> values);
template <class Value>
void write_rows(const dpde_layout& layout, void* base, std::int64_t first, std::span<const Value> values);
/// The interior, x fastest, by a team where it is large. `base` points at the cell (0,0,0).
void read_cells(const dpde_layout& layout, const void* base, std::span<double> values, const Team& team = 1);
void write_cells(const dpde_layout& layout, void* base, std::span<const double> values, const Team& team = 1);

std::int64_t bytes_of_real(const dpde_layout& layout);
/// The interior as it is, rows one behind the other.
void copy_to_rows(const dpde_layout& layout, const void* base, char* rows, const Team& team = 1);
void copy_from_rows(const dpde_layout& layout, const char* rows, void* base, const Team& team = 1);

/// Of the bytes of the interior, and of `before`.
std::uint64_t hash_of(const dpde_layout& layout, const void* base, const Team& team = 1, std::uint64_t before = 0);

/// Coefficients and parameters that an operator was seen with. Of fields a hash of 64 bits is kept, not a copy: that of
/// other values is the same with a probability of 2^-64.
class SolveInputs {
 public:
  SolveInputs() = default;
  SolveInputs(const dpde_solve& solve, const dpde_layout& layout);

  /// Whether they are others than before; keeps what is new.
  bool have_changed(void* const* fields, const double* params, const Team& team = 1);

 private:
  dpde_solve solve_{};
  dpde_layout layout_{};
  std::vector<std::uint64_t> coefficients_;
  std::vector<double> params_;
  bool is_new_ = true;
};

}  // namespace dpde
