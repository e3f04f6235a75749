// SPDX-License-Identifier: Apache-2.0
// Memory of fields and copies to and from dense arrays.
#include "dpde/runtime/field.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/aligned_memory.h"
#include "dpde/runtime/allocation.h"
#include "dpde/runtime/error.h"
#include "grid/real.h"
#include "grid/rows.h"

namespace dpde {
namespace {

void check_length(const dpde_layout& layout, size_t length) {
  if (static_cast<int64_t>(length) == cell_count(layout)) return;
  throw Error(ErrorKind::input,
              fmt::format("an array of {} values does not fit a grid of {} cells", length, cell_count(layout)));
}

/// True if a value of the row is infinite or NaN: then x - x is NaN, else 0. Summed in independent lanes, so that the
/// compiler may vectorise without reordering.
template <class Real>
bool row_is_bad(const Real* row, int64_t count) {
  constexpr size_t lanes = 64 / sizeof(Real);
  constexpr auto step = static_cast<int64_t>(lanes);
  std::array<Real, lanes> sums{};
  int64_t x = 0;
  for (; x + step <= count; x += step) {
    for (size_t k = 0; k < lanes; ++k) sums[k] += row[x + static_cast<int64_t>(k)] - row[x + static_cast<int64_t>(k)];
  }
  for (; x < count; ++x) sums[0] += row[x] - row[x];
  Real total = 0;
  for (Real sum : sums) total += sum;
  return !(total == 0);
}

/// Calls `f(y, z)` for each interior row, in memory order.
template <class F>
void for_each_row(const dpde_layout& layout, const F& f) {
  for (int64_t z = 0; z < layout.cells[2]; ++z) {
    for (int64_t y = 0; y < layout.cells[1]; ++y) f(y, z);
  }
}

/// Calls `f(to, from, count)` for each interior row of one field and the same row of another.
template <class F>
void pair_rows(const dpde_layout& layout, void* to, const FieldView& from, const Team& team, const F& f) {
  constexpr int64_t least_cells = 32 * 1024;  // fewer are not worth several threads
  const int64_t parts = cell_count(layout) < least_cells ? 1 : team.threads();
  with_real(layout.real, [&](auto to_real) {
    with_real(from.layout->real, [&](auto from_real) {
      share_rows(team, parts, layout.cells[1], layout.cells[2], [&](int64_t y, int64_t z) {
        f(static_cast<decltype(to_real)*>(to) + index_of(layout, 0, y, z),
          static_cast<const decltype(from_real)*>(from.base) + index_of(*from.layout, 0, y, z), layout.cells[0]);
      });
    });
  });
}

/// A block copy if nothing is converted.
template <class From, class To>
void copy_row(const From* from, int64_t count, To* to) {
  if constexpr (std::is_same_v<From, To>) {
    std::copy_n(from, count, to);
  } else {
    for (int64_t x = 0; x < count; ++x) to[x] = static_cast<To>(from[x]);
  }
}

int64_t periodic_cell(int64_t i, int64_t n) { return ((i % n) + n) % n; }

}  // namespace

int64_t bytes_of_field(const dpde_layout& layout) {
  const int64_t own = field_bytes(layout);
  if (own <= page_bytes || allocated_bytes(own) - own >= page_bytes) return allocated_bytes(own);
  return own + 3 * page_bytes / 2;  // stagger, rest of the last page, space before the first: half a page each
}

int64_t stagger_of(const dpde_layout& layout, int number) {
  if (field_bytes(layout) < page_bytes) return 0;
  return (int64_t{number} * 5 % 64) * 64;  // lines of 64 bytes, distinct for 64 fields
}

Field::Field(const dpde_layout& layout, int number) : layout_(layout) {
  const int64_t stagger = stagger_of(layout, number);
  memory_ = Buffer(field_bytes(layout) + stagger);
  base_ = moved(memory_.data() + stagger, layout.origin, real_bytes(layout));
}

double Field::at(int64_t x, int64_t y, int64_t z) const { return value_at(layout_, base_, {x, y, z}); }
void Field::set(double value, int64_t x, int64_t y, int64_t z) {
  with_real(layout_.real,
            [&](auto real) { as<decltype(real)>()[index_of(layout_, x, y, z)] = static_cast<decltype(real)>(value); });
}
void Field::fill(double value) { fill_all(layout_, base_, value); }
void Field::copy_in(std::span<const double> dense) { dpde::copy_in(layout_, base_, dense); }
void Field::copy_out(std::span<double> dense) const { dpde::copy_out(layout_, base_, dense); }

void copy_in(const dpde_layout& layout, void* base, std::span<const double> dense) {
  check_length(layout, dense.size());
  with_real(layout.real, [&](auto real) {
    using Real = decltype(real);
    const double* from = dense.data();
    for_each_row(layout, [&](int64_t y, int64_t z) {
      copy_row(from, layout.cells[0], static_cast<Real*>(base) + index_of(layout, 0, y, z));
      from += layout.cells[0];
    });
  });
}

void copy_out(const dpde_layout& layout, const void* base, std::span<double> dense) {
  check_length(layout, dense.size());
  with_real(layout.real, [&](auto real) {
    double* to = dense.data();
    for_each_row(layout, [&](int64_t y, int64_t z) {
      to = std::copy_n(static_cast<const decltype(real)*>(base) + index_of(layout, 0, y, z), layout.cells[0], to);
    });
  });
}

void copy_all(const dpde_layout& layout, void* to, const void* from) {
  const int64_t bytes = real_bytes(layout);
  std::memcpy(moved(to, -layout.origin, bytes), moved(from, -layout.origin, bytes),
              static_cast<size_t>(field_bytes(layout)));
}

void fill_all(const dpde_layout& layout, void* base, double value) {
  with_real(layout.real, [&](auto real) {
    std::fill_n(static_cast<decltype(real)*>(base) - layout.origin, layout.size, static_cast<decltype(real)>(value));
  });
}

void copy_interior(const dpde_layout& layout, void* to, const FieldView& from) {
  pair_rows(layout, to, from, 1, [](auto* row, const auto* values, int64_t count) { copy_row(values, count, row); });
}

void add_interior(const dpde_layout& layout, void* to, const FieldView& from, const Team& team) {
  pair_rows(layout, to, from, team, []<class To>(To* row, const auto* values, int64_t count) {
#pragma omp simd  // without it g++ -O2 does not vectorise
    for (int64_t x = 0; x < count; ++x) row[x] += static_cast<To>(values[x]);
  });
}

double value_at(const dpde_layout& layout, const void* base, const Cell& cell) {
  return with_real(layout.real, [&](auto real) {
    return static_cast<double>(static_cast<const decltype(real)*>(base)[index_of(layout, cell.x, cell.y, cell.z)]);
  });
}

void fill_coordinate(Field& field, int axis, double low, double spacing, bool periodic) {
  const dpde_layout& layout = field.layout();
  const auto a = static_cast<size_t>(axis);
  const auto value = [&](int64_t i) {
    const int64_t place = i + layout.first[a], cell = periodic ? periodic_cell(place, layout.global[a]) : place;
    return low + (static_cast<double>(cell) + 0.5) * spacing;
  };
  for (int64_t z = -layout.halo[2]; z < layout.cells[2] + layout.halo[2]; ++z) {
    for (int64_t y = -layout.halo[1]; y < layout.cells[1] + layout.halo[1]; ++y) {
      const std::array<int64_t, 3> place{0, y, z};
      for (int64_t x = -layout.halo[0]; x < layout.cells[0] + layout.halo[0]; ++x) {
        field.set(value(axis == 0 ? x : place[a]), x, y, z);
      }
    }
  }
}

std::optional<Cell> find_not_finite(const dpde_layout& layout, const void* base) {
  std::optional<Cell> found;
  with_real(layout.real, [&](auto real) {
    for_each_row(layout, [&](int64_t y, int64_t z) {
      const auto* row = static_cast<const decltype(real)*>(base) + index_of(layout, 0, y, z);
      if (found || !row_is_bad(row, layout.cells[0])) return;
      for (int64_t x = 0; x < layout.cells[0] && !found; ++x) {
        if (!std::isfinite(row[x])) found = Cell{x, y, z};
      }
    });
  });
  return found;
}

double largest(const dpde_layout& layout, const void* base) {
  double result = -std::numeric_limits<double>::infinity();
  int has_nan = 0;
  with_real(layout.real, [&](auto real) {
    using Real = decltype(real);
    for_each_row(layout, [&](int64_t y, int64_t z) {
      const Real* row = static_cast<const Real*>(base) + index_of(layout, 0, y, z);
      Real most = -std::numeric_limits<Real>::infinity();
#pragma omp simd reduction(max                 \
                           : most) reduction(| \
                                             : has_nan)  // without this pragma g++ -O2 does not vectorise the loop
      for (int64_t x = 0; x < layout.cells[0]; ++x) {
        most = row[x] > most ? row[x] : most;
        has_nan |= static_cast<int>(row[x] != row[x]);
      }
      result = std::max(result, static_cast<double>(most));
    });
  });
  return has_nan != 0 ? std::numeric_limits<double>::quiet_NaN() : result;
}

double largest_difference(const dpde_layout& layout, const void* a, const void* b, double enough) {
  double result = 0;
  with_real(layout.real, [&](auto real) {
    using Real = decltype(real);
    for_each_row(layout, [&](int64_t y, int64_t z) {
      if (!(result <= enough)) return;
      const int64_t first = index_of(layout, 0, y, z);
      const Real *of_a = static_cast<const Real*>(a) + first, *of_b = static_cast<const Real*>(b) + first;
      double most = 0;
      int has_nan = 0;
#pragma omp simd reduction(max : most) reduction(| : has_nan)
      for (int64_t x = 0; x < layout.cells[0]; ++x) {
        const double distance = std::abs(static_cast<double>(of_a[x]) - static_cast<double>(of_b[x]));
        most = distance > most ? distance : most;
        has_nan |= static_cast<int>(distance != distance);
      }
      result = has_nan != 0 ? std::numeric_limits<double>::quiet_NaN() : std::max(result, most);
    });
  });
  return result;
}

bool is_finite(const dpde_layout& layout, const void* base) { return !find_not_finite(layout, base).has_value(); }

}  // namespace dpde
