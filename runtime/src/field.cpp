// SPDX-License-Identifier: Apache-2.0
// Memory of fields and copies to and from dense arrays.
#include "dpde/runtime/field.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "aligned_memory.h"
#include "dpde/runtime/error.h"

namespace dpde {
namespace {

constexpr int64_t page_bytes = 4096;

void check_length(const dpde_layout& layout, size_t length) {
  if (static_cast<int64_t>(length) == cell_count(layout)) return;
  throw Error(ErrorKind::input, fmt::format("an array of {} values does not fit a grid of {} cells", length, cell_count(layout)));
}

/// True when some value of the row is infinite or not a number: x - x is then not a number, else 0. Eight sums, so that
/// the compiler may use vectors without reordering anything.
bool row_is_bad(const double* row, int64_t count) {
  std::array<double, 8> sums{};
  int64_t x = 0;
  for (; x + 8 <= count; x += 8) {
    for (size_t k = 0; k < 8; ++k) sums[k] += row[x + static_cast<int64_t>(k)] - row[x + static_cast<int64_t>(k)];
  }
  for (; x < count; ++x) sums[0] += row[x] - row[x];
  double total = 0;
  for (double sum : sums) total += sum;
  return !(total == 0);
}

int64_t physical_bytes() { return int64_t{sysconf(_SC_PHYS_PAGES)} * sysconf(_SC_PAGESIZE); }

int64_t wrapped(int64_t i, int64_t n) { return ((i % n) + n) % n; }

}  // namespace

double* allocate_doubles(int64_t count) {
  const int64_t bytes = (count * static_cast<int64_t>(sizeof(double)) + page_bytes - 1) / page_bytes * page_bytes;
  const size_t alignment = bytes > page_bytes ? page_bytes : 64;
  // Linux may promise more than there is and kill the process later: refuse what can never fit.
  void* memory = bytes > physical_bytes() ? nullptr : std::aligned_alloc(alignment, static_cast<size_t>(bytes));
  if (memory == nullptr) throw Error(ErrorKind::machine, fmt::format("there is no memory for {} bytes", bytes));
  std::memset(memory, 0, static_cast<size_t>(bytes));
  return static_cast<double*>(memory);
}

int64_t stagger_of(const dpde_layout& layout, int number) {
  if (field_bytes(layout) < page_bytes) return 0;
  return (int64_t{number} * 5 % 64) * 8;  // lines of 64 bytes, distinct for 64 fields
}

Field::Field(const dpde_layout& layout, int number) : layout_(layout) {
  const int64_t stagger = stagger_of(layout, number);
  double* memory = allocate_doubles(layout.size + stagger);
  memory_.reset(memory);
  base_ = memory + stagger + layout.origin;
}

void Field::fill(double value) { std::fill_n(base_ - layout_.origin, layout_.size, value); }
void Field::copy_in(std::span<const double> dense) { dpde::copy_in(layout_, base_, dense); }
void Field::copy_out(std::span<double> dense) const { dpde::copy_out(layout_, base_, dense); }

void copy_in(const dpde_layout& layout, double* base, std::span<const double> dense) {
  check_length(layout, dense.size());
  const double* from = dense.data();
  for (int64_t z = 0; z < layout.cells[2]; ++z) {
    for (int64_t y = 0; y < layout.cells[1]; ++y, from += layout.cells[0]) {
      std::copy_n(from, layout.cells[0], base + index_of(layout, 0, y, z));
    }
  }
}

void copy_out(const dpde_layout& layout, const double* base, std::span<double> dense) {
  check_length(layout, dense.size());
  double* to = dense.data();
  for (int64_t z = 0; z < layout.cells[2]; ++z) {
    for (int64_t y = 0; y < layout.cells[1]; ++y, to += layout.cells[0]) {
      std::copy_n(base + index_of(layout, 0, y, z), layout.cells[0], to);
    }
  }
}

void fill_coordinate(Field& field, int axis, double low, double spacing, bool periodic) {
  const dpde_layout& layout = field.layout();
  const auto a = static_cast<size_t>(axis);
  const auto value = [&](int64_t i) {
    const int64_t cell = periodic ? wrapped(i, layout.cells[a]) : i;
    return low + (static_cast<double>(cell) + 0.5) * spacing;
  };
  for (int64_t z = -layout.halo[2]; z < layout.cells[2] + layout.halo[2]; ++z) {
    for (int64_t y = -layout.halo[1]; y < layout.cells[1] + layout.halo[1]; ++y) {
      const std::array<int64_t, 3> place{0, y, z};
      for (int64_t x = -layout.halo[0]; x < layout.cells[0] + layout.halo[0]; ++x) {
        field.at(x, y, z) = value(axis == 0 ? x : place[a]);
      }
    }
  }
}

std::optional<Cell> find_not_finite(const dpde_layout& layout, const double* base) {
  for (int64_t z = 0; z < layout.cells[2]; ++z) {
    for (int64_t y = 0; y < layout.cells[1]; ++y) {
      const double* row = base + index_of(layout, 0, y, z);
      if (!row_is_bad(row, layout.cells[0])) continue;
      for (int64_t x = 0; x < layout.cells[0]; ++x) {
        if (!std::isfinite(row[x])) return Cell{x, y, z};
      }
    }
  }
  return std::nullopt;
}

bool is_finite(const dpde_layout& layout, const double* base) { return !find_not_finite(layout, base).has_value(); }

}  // namespace dpde
