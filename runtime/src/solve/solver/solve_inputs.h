// SPDX-License-Identifier: Apache-2.0
// Common parts of a program's solves: values of fields as contiguous rows, and detection of changed operators.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/team.h"

namespace dpde {

/// The layout with one cell along missing axes.
dpde_layout with_three_axes(dpde_layout layout);
std::size_t cells_of(const dpde_layout& layout);
/// Relative rounding of its numbers.
double rounding_of(const dpde_layout& layout);

/// An axis is periodic if a fill in the operator says so, of an unknown or of any other field.
std::array<bool, 3> periodic_axes(const dpde_solve& solve, const dpde_layout& layout);

/// Copies whole rows of the interior, x fastest, from cell `first` on. `base` points at cell (0,0,0).
template <class Value>
void read_rows(const dpde_layout& layout, const void* base, std::int64_t first, std::span<Value> values);
template <class Value>
void write_rows(const dpde_layout& layout, void* base, std::int64_t first, std::span<const Value> values);
/// Copies the interior, x fastest, in parallel if it is large. `base` points at cell (0,0,0).
void read_cells(const dpde_layout& layout, const void* base, std::span<double> values, const Team& team = 1);
void write_cells(const dpde_layout& layout, void* base, std::span<const double> values, const Team& team = 1);

std::int64_t bytes_of_real(const dpde_layout& layout);
/// Copies the interior in the layout's type, as contiguous rows.
void copy_to_rows(const dpde_layout& layout, const void* base, char* rows, const Team& team = 1);
void copy_from_rows(const dpde_layout& layout, const char* rows, void* base, const Team& team = 1);

/// Hash of the bytes of the interior, chained to `before`.
std::uint64_t hash_of(const dpde_layout& layout, const void* base, const Team& team = 1, std::uint64_t before = 0);

/// Coefficients and parameters of the last operator. Of fields a 64-bit hash is stored, not a copy: different values
/// have the same hash with a probability of 2^-64.
class SolveInputs {
 public:
  SolveInputs() = default;
  SolveInputs(const dpde_solve& solve, const dpde_layout& layout);

  /// Whether they have changed; stores the new ones.
  bool have_changed(void* const* fields, const double* params, const Team& team = 1);

 private:
  dpde_solve solve_{};
  dpde_layout layout_{};
  std::vector<std::uint64_t> coefficients_;
  std::vector<double> params_;
  bool is_new_ = true;
};

}  // namespace dpde
