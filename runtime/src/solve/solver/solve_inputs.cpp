// SPDX-License-Identifier: Apache-2.0
#include "solve/solver/solve_inputs.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <utility>

#include "grid/real.h"
#include "solve/operator/vector_parts.h"

namespace dpde {
namespace {

/// Calls f(element of a field, index among the values) for the first cell of each row.
template <class F>
void for_each_row(const dpde_layout& layout, std::int64_t first, std::size_t count, const F& f) {
  std::int64_t row = first / layout.cells[0];
  for (std::size_t at = 0; at < count; at += static_cast<std::size_t>(layout.cells[0]), ++row)
    f(row % layout.cells[1] * layout.stride[1] + row / layout.cells[1] * layout.stride[2], at);
}

/// Calls f(index of the share, first cell, cells); shares are whole rows.
template <class F>
void for_each_share(const dpde_layout& layout, const Team& team, const F& f) {
  const std::int64_t n = layout.cells[0], rows = layout.cells[1] * layout.cells[2],
                     shares = std::min(rows, VectorParts::most);
  const auto one = [&](std::int64_t share, int = 0) {
    const std::int64_t begin = rows * share / shares, end = rows * (share + 1) / shares;
    f(share, begin * n, static_cast<std::size_t>((end - begin) * n));
  };
  if (cells_of(layout) >= VectorParts::least_shared) return team.run(shares, one);
  for (std::int64_t share = 0; share < shares; ++share) one(share);
}

}  // namespace

dpde_layout with_three_axes(dpde_layout layout) {
  for (int axis = layout.rank; axis < 3; ++axis) layout.cells[axis] = 1;
  return layout;
}

double rounding_of(const dpde_layout& layout) { return layout.real == DPDE_F32 ? 0x1p-23 : 0x1p-52; }

std::int64_t bytes_of_real(const dpde_layout& layout) { return layout.real == DPDE_F32 ? 4 : 8; }

std::size_t cells_of(const dpde_layout& layout) {
  return static_cast<std::size_t>(layout.cells[0] * layout.cells[1] * layout.cells[2]);
}

std::array<bool, 3> periodic_axes(const dpde_solve& solve, const dpde_layout& layout) {
  std::array<bool, 3> periodic{};
  for (int32_t i = 0; i < solve.operation_count; ++i) {
    const dpde_operation& operation = solve.operations[i];
    const auto note = [&](const dpde_fill& fill) {
      for (size_t axis = 0; axis < 3; ++axis)
        periodic[axis] = static_cast<int32_t>(axis) < layout.rank && fill.axes[axis].low.rule == nullptr;
    };
    if (operation.kind == DPDE_FILL || operation.kind == DPDE_FOLD) note(operation.fill);
    for (int32_t k = 0; operation.kind == DPDE_SWEEP && k < operation.then_count; ++k) note(operation.then[k]);
  }
  return periodic;
}

template <class Value>
void read_rows(const dpde_layout& layout, const void* base, std::int64_t first, std::span<Value> values) {
  with_real(layout.real, [&](auto real) {
    const auto* const cells = static_cast<const decltype(real)*>(base);
    for_each_row(layout, first, values.size(), [&](std::int64_t row, std::size_t at) {
      std::copy_n(cells + row, layout.cells[0], values.data() + at);
    });
  });
}
template void read_rows(const dpde_layout&, const void*, std::int64_t, std::span<double>);
template void read_rows(const dpde_layout&, const void*, std::int64_t, std::span<float>);

template <class Value>
void write_rows(const dpde_layout& layout, void* base, std::int64_t first, std::span<const Value> values) {
  with_real(layout.real, [&](auto real) {
    using Real = decltype(real);
    auto* const cells = static_cast<Real*>(base);
    for_each_row(layout, first, values.size(), [&](std::int64_t row, std::size_t at) {
      if constexpr (std::is_same_v<Real, Value>) {
        std::copy_n(values.data() + at, layout.cells[0], cells + row);
      } else {
        for (std::int64_t x = 0; x < layout.cells[0]; ++x)
          cells[row + x] = static_cast<Real>(values[at + static_cast<std::size_t>(x)]);
      }
    });
  });
}
template void write_rows(const dpde_layout&, void*, std::int64_t, std::span<const double>);
template void write_rows(const dpde_layout&, void*, std::int64_t, std::span<const float>);

void copy_to_rows(const dpde_layout& layout, const void* base, char* rows, const Team& team) {
  const std::int64_t bytes = bytes_of_real(layout), row = layout.cells[0] * bytes;
  for_each_share(layout, team, [&](std::int64_t, std::int64_t first, std::size_t count) {
    for_each_row(layout, first, count, [&](std::int64_t from, std::size_t at) {
      std::memcpy(rows + (first + static_cast<std::int64_t>(at)) * bytes, moved(base, from, bytes),
                  static_cast<std::size_t>(row));
    });
  });
}

void copy_from_rows(const dpde_layout& layout, const char* rows, void* base, const Team& team) {
  const std::int64_t bytes = bytes_of_real(layout), row = layout.cells[0] * bytes;
  for_each_share(layout, team, [&](std::int64_t, std::int64_t first, std::size_t count) {
    for_each_row(layout, first, count, [&](std::int64_t to, std::size_t at) {
      std::memcpy(moved(base, to, bytes), rows + (first + static_cast<std::int64_t>(at)) * bytes,
                  static_cast<std::size_t>(row));
    });
  });
}

void read_cells(const dpde_layout& layout, const void* base, std::span<double> values, const Team& team) {
  for_each_share(layout, team, [&](std::int64_t, std::int64_t first, std::size_t count) {
    read_rows<double>(layout, base, first, values.subspan(static_cast<std::size_t>(first), count));
  });
}

void write_cells(const dpde_layout& layout, void* base, std::span<const double> values, const Team& team) {
  for_each_share(layout, team, [&](std::int64_t, std::int64_t first, std::size_t count) {
    write_rows<double>(layout, base, first, values.subspan(static_cast<std::size_t>(first), count));
  });
}

namespace {

/// The rounds of xxHash64 (Y. Collet, XXH64) on lines of bytes: each word is mixed into one of four independent sums.
/// Lines may have any length; the hash depends on the division into lines.
class Hash {
 public:
  void add(const char* bytes, std::size_t count) {
    for (; count >= sizeof sums_; bytes += sizeof sums_, count -= sizeof sums_) {
      for (std::size_t i = 0; i < sums_.size(); ++i) {
        std::uint64_t word;
        std::memcpy(&word, bytes + i * sizeof word, sizeof word);
        mix(sums_[i], word);
      }
    }
    for (std::size_t i = 0; count > 0; ++i) {
      std::uint64_t word = 0;
      const std::size_t part = std::min(count, sizeof word);
      std::memcpy(&word, bytes, part);
      mix(sums_[i], word);
      bytes += part;
      count -= part;
    }
  }
  std::uint64_t value() const {
    std::uint64_t sum =
        std::rotl(sums_[0], 1) + std::rotl(sums_[1], 7) + std::rotl(sums_[2], 12) + std::rotl(sums_[3], 18);
    for (std::uint64_t part : sums_) {
      std::uint64_t mixed = 0;
      mix(mixed, part);
      sum = (sum ^ mixed) * first + fourth;
    }
    sum = (sum ^ sum >> 33) * second;
    sum = (sum ^ sum >> 29) * third;
    return sum ^ sum >> 32;
  }

 private:
  static constexpr std::uint64_t first = 0x9E3779B185EBCA87, second = 0xC2B2AE3D27D4EB4F, third = 0x165667B19E3779F9,
                                 fourth = 0x85EBCA77C2B2AE63;
  static void mix(std::uint64_t& sum, std::uint64_t word) { sum = std::rotl(sum + word * second, 31) * first; }
  std::array<std::uint64_t, 4> sums_{first + second, second, 0, 0 - first};
};

/// Hash of whole rows from cell `first` on.
std::uint64_t hash_of_rows(const dpde_layout& layout, const void* base, std::int64_t first, std::size_t count) {
  Hash hash;
  const std::int64_t bytes = bytes_of_real(layout);
  for_each_row(layout, first, count, [&](std::int64_t row, std::size_t) {
    hash.add(moved(base, row, bytes), static_cast<std::size_t>(layout.cells[0] * bytes));
  });
  return hash.value();
}

}  // namespace

std::uint64_t hash_of(const dpde_layout& layout, const void* base, const Team& team, std::uint64_t before) {
  std::array<std::uint64_t, VectorParts::most + 1> parts{};
  parts.back() = before;
  for_each_share(layout, team, [&](std::int64_t share, std::int64_t first, std::size_t count) {
    parts[static_cast<std::size_t>(share)] = hash_of_rows(layout, base, first, count);
  });
  Hash hash;
  hash.add(reinterpret_cast<const char*>(parts.data()), sizeof parts);
  return hash.value();
}

SolveInputs::SolveInputs(const dpde_solve& solve, const dpde_layout& layout)
    : solve_(solve),
      layout_(with_three_axes(layout)),
      coefficients_(static_cast<std::size_t>(solve.coefficient_count), 0),
      params_(static_cast<std::size_t>(solve.param_count), 0.0) {}

bool SolveInputs::have_changed(void* const* fields, const double* params, const Team& team) {
  bool changed = std::exchange(is_new_, false);
  for (std::size_t i = 0; i < params_.size(); ++i) {
    const double now = params[solve_.params[i]];
    changed = changed || now != params_[i];
    params_[i] = now;
  }
  for (std::size_t i = 0; i < coefficients_.size(); ++i) {
    const std::uint64_t now = hash_of(layout_, fields[solve_.coefficients[i]], team);
    changed = changed || now != coefficients_[i];
    coefficients_[i] = now;
  }
  return changed;
}

}  // namespace dpde
