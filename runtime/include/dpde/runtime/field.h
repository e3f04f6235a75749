// SPDX-License-Identifier: Apache-2.0
// A field: aligned memory with a layout, and copies between fields and dense arrays. A field holds doubles or floats,
// by layout.real; dense arrays and single values are always doubles.
//
// Dense arrays hold the interior only, x fastest: C order of shape (nz, ny, nx). A new field is zero, halo included.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "dpde/runtime/buffer.h"
#include "dpde/runtime/layout.h"
#include "dpde/runtime/team.h"

namespace dpde {

class Field {
 public:
  /// `number` staggers the base addresses of the fields of a simulation modulo 4 KiB: count them 0, 1, 2, ...
  /// @throws Error(machine) naming the bytes when there is no memory.
  explicit Field(const dpde_layout& layout, int number = 0);
  /// base() is null: for plans, which only count fields.
  static Field without_memory(const dpde_layout& layout) { return Field(layout, nullptr); }

  const dpde_layout& layout() const { return layout_; }
  /// Pointer to cell (0, 0, 0).
  void* base() { return base_; }
  const void* base() const { return base_; }
  /// The same as Real (double, float), which must be the layout's type.
  template <class Real>
  Real* as() {
    return static_cast<Real*>(base_);
  }
  template <class Real>
  const Real* as() const {
    return static_cast<const Real*>(base_);
  }
  double at(int64_t x, int64_t y = 0, int64_t z = 0) const;
  void set(double value, int64_t x, int64_t y = 0, int64_t z = 0);

  /// Sets every element, halo included.
  void fill(double value);
  /// @throws Error(input) when the length is not cell_count(layout()).
  void copy_in(std::span<const double> dense);
  void copy_out(std::span<double> dense) const;

 private:
  Field(const dpde_layout& layout, std::nullptr_t) : layout_(layout), base_(nullptr) {}

  dpde_layout layout_;
  Buffer memory_;
  void* base_;
};

/// Read-only view of a field that another object owns; base null: no field.
struct FieldView {
  const dpde_layout* layout = nullptr;
  const void* base = nullptr;
};

/// The same for memory that is not a Field; `base` points at cell (0, 0, 0).
void copy_in(const dpde_layout& layout, void* base, std::span<const double> dense);
void copy_out(const dpde_layout& layout, const void* base, std::span<double> dense);
inline void copy_out(const FieldView& view, std::span<double> dense) { copy_out(*view.layout, view.base, dense); }
/// Copies the whole allocation, halo included.
void copy_all(const dpde_layout& layout, void* to, const void* from);
void fill_all(const dpde_layout& layout, void* base, double value);
/// Copies the interior of `from`, rounded to the type of `layout`; strides may differ, numbers of cells must not.
void copy_interior(const dpde_layout& layout, void* to, const FieldView& from);
/// to += from in the interior, on the threads of `team`.
void add_interior(const dpde_layout& layout, void* to, const FieldView& from, const Team& team);

/// Sets the whole field, halo included, to the coordinate of the cell centres along `axis`: low + (i + 1/2) * spacing.
/// In the halo i wraps if `periodic`, and continues linearly otherwise.
void fill_coordinate(Field& field, int axis, double low, double spacing, bool periodic);

struct Cell {
  int64_t x = 0, y = 0, z = 0;
  bool operator==(const Cell&) const = default;
};

/// The first interior cell, in memory order, with a value that is infinite or NaN.
std::optional<Cell> find_not_finite(const dpde_layout& layout, const void* base);
bool is_finite(const dpde_layout& layout, const void* base);
double value_at(const dpde_layout& layout, const void* base, const Cell& cell);
/// Largest interior value; NaN if one is NaN.
double largest(const dpde_layout& layout, const void* base);
/// The largest |a - b| over interior cells; stops early after the first rows with one above `enough`. NaN if one is
/// NaN.
double largest_difference(const dpde_layout& layout, const void* a, const void* b, double enough);

}  // namespace dpde
