// SPDX-License-Identifier: Apache-2.0
// Where the cells of a field lie in memory. Holds for every layout made here:
//  - cell (0, y, z) of every row starts on a 64-byte boundary when the allocation does;
//  - at least max(halo, one line of 64 bytes) elements lie before and after the cells of a row, and one line more
//    before the first and after the last row: kernels read whole lines, wherever a row begins;
//  - a grid that is made alone is whole (`global`, `first`);
//  - the strides of y and z are multiples of 64 bytes and no multiples of 4 KiB (stores and loads do not collide).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "dpde/kernel_abi.h"

namespace dpde {

/// Layout of a grid of `cells` (x, y, z order, 1 to 3 entries >= 1) with `halo` cells on each side (entries beyond the
/// rank are ignored) and values of type `real` (DPDE_F64, DPDE_F32).
/// @throws Error(input) for a rank that is not 1..3, cells < 1, halo < 0, and in single precision for more than 2^24
/// cells along an axis (neighbouring centres would round to the same number); Error(machine) for more bytes than
/// addressable.
dpde_layout make_layout(std::span<const int64_t> cells, const std::array<int64_t, 3>& halo, int32_t real = DPDE_F64);

/// Layout of the subgrid at `place`, if a grid of `global` cells is divided among ranks[a] ranks along each axis a, as
/// equally as possible.
/// @throws Error(input) also if a subgrid has fewer cells than its halo along an axis that is divided.
dpde_layout make_subgrid(std::span<const int64_t> global, const std::array<int64_t, 3>& ranks,
                         const std::array<int64_t, 3>& place, const std::array<int64_t, 3>& halo,
                         int32_t real = DPDE_F64);

/// Whether the grid is divided along the axis: the same result for all its subgrids.
inline bool is_divided(const dpde_layout& layout, size_t axis) { return layout.cells[axis] != layout.global[axis]; }
inline bool is_divided(const dpde_layout& layout) {
  return is_divided(layout, 0) || is_divided(layout, 1) || is_divided(layout, 2);
}
/// Whether a side is a subdomain interface: the next cells belong to another subgrid. The ends of a periodic axis do
/// not count.
inline bool has_low_seam(const dpde_layout& layout, size_t axis) { return layout.first[axis] > 0; }
inline bool has_high_seam(const dpde_layout& layout, size_t axis) {
  return layout.first[axis] + layout.cells[axis] < layout.global[axis];
}

/// Bytes of one value.
inline int64_t real_bytes(const dpde_layout& layout) { return layout.real == DPDE_F32 ? 4 : 8; }

/// Interior cells: the length of a dense array.
int64_t cell_count(const dpde_layout& layout);
/// The same for the whole grid.
int64_t global_cell_count(const dpde_layout& layout);

/// Bytes of one field, halo and padding included.
int64_t field_bytes(const dpde_layout& layout);

/// Element index of cell (x, y, z) relative to the base pointer.
inline int64_t index_of(const dpde_layout& layout, int64_t x, int64_t y, int64_t z) {
  return x + y * layout.stride[1] + z * layout.stride[2];
}

}  // namespace dpde
