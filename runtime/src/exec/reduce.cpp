// SPDX-License-Identifier: Apache-2.0
#include "exec/reduce.h"

#include <algorithm>
#include <limits>

#include "base/aligned_memory.h"
#include "dpde/runtime/layout.h"
#include "exec/sweep.h"
#include "grid/real.h"

namespace dpde {
namespace {

constexpr int64_t lanes = 8;      // independent partial sums of a row
constexpr int64_t widest = 2048;  // longest piece of a row that is combined across rows in one go

struct Add {
  double operator()(double a, double b) const { return a + b; }
};
/// Keeps NaN, so that broken fields show.
struct Larger {
  double operator()(double a, double b) const { return b > a || b != b ? b : a; }
};
struct Smaller {
  double operator()(double a, double b) const { return b < a || b != b ? b : a; }
};

template <class Real, class Combine>
double value_of_row(const Real* row, int64_t count, double first, const Combine& combine) {
  double lane[lanes];
  std::fill(lane, lane + lanes, first);
  const int64_t whole = count / lanes * lanes;
  for (int64_t i = 0; i < whole; i += lanes) {
    for (int64_t l = 0; l < lanes; ++l) lane[l] = combine(lane[l], row[i + l]);
  }
  for (int64_t i = whole; i < count; ++i) lane[i - whole] = combine(lane[i - whole], row[i]);
  for (int64_t width = lanes / 2; width > 0; width /= 2) {
    for (int64_t l = 0; l < width; ++l) lane[l] = combine(lane[l], lane[l + width]);
  }
  return lane[0];
}

}  // namespace

FieldReduction::FieldReduction(const dpde_reduce& reduce, const dpde_layout& layout, const Team& team,
                               Communicator* ranks)
    : reduce_(reduce), real_(layout.real) {
  int64_t all = 1;
  for (size_t axis = 0; axis < 3; ++axis) {
    const bool exists = static_cast<int32_t>(axis) < layout.rank;
    cells_[axis] = exists ? layout.cells[axis] : 1;
    stride_[axis] = exists ? layout.stride[axis] : 0;
    all *= cells_[axis];
    if (over(axis) && exists) count_ *= static_cast<double>(layout.global[axis]);
    if (over(axis) && is_divided(layout, axis)) ranks_ = ranks;
  }
  if (all >= least_cells_for_threads) team_ = team;
  const int64_t threads = team_.threads();
  // At most so long that each thread has a piece: pieces far apart in memory are slow to read (measured: 128 cells take
  // twice the time of 1024, over y at 1024^2). Results do not depend on it, since each cell is only combined with those
  // of other rows.
  const int64_t line = line_bytes / real_bytes(layout), share = (cells_[0] + threads - 1) / threads;
  piece_ = std::min(widest, (share + line - 1) / line * line);
  if (over(0)) rows_.assign(static_cast<size_t>(cells_[1] * cells_[2]), 0.0);
  if (ranks_ != nullptr || over(0)) values_.assign(static_cast<size_t>(groups(0) * groups(1) * groups(2)), 0.0);
}

void FieldReduction::run(void* const* fields) {
  with_real(real_, [&](auto real) {
    using Real = decltype(real);
    const Real* from = static_cast<const Real*>(fields[reduce_.field]);
    Real* to = static_cast<Real*>(fields[reduce_.result]);
    constexpr double infinity = std::numeric_limits<double>::infinity();
    if (reduce_.kind == DPDE_MAX) return reduce(from, to, -infinity, Larger{});
    if (reduce_.kind == DPDE_MIN) return reduce(from, to, infinity, Smaller{});
    reduce(from, to, 0.0, Add{});
  });
}

template <class Real, class Combine>
void FieldReduction::reduce(const Real* from, Real* to, double first, const Combine& combine) {
  if (over(0)) return reduce_rows(from, to, first, combine);
  reduce_across_rows(from, to, first, combine);
}

/// Reduces each row by itself, then across rows.
template <class Real, class Combine>
void FieldReduction::reduce_rows(const Real* from, Real* to, double first, const Combine& combine) {
  const int64_t count = cells_[1] * cells_[2];
  const auto place = [&](int64_t row) { return row % cells_[1] * stride_[1] + row / cells_[1] * stride_[2]; };
  team_.run(count, [&](int64_t row, int) {
    rows_[static_cast<size_t>(row)] = value_of_row(from + place(row), cells_[0], first, combine);
  });
  combine_rows(first, combine);
  team_.run(count, [&](int64_t row, int) {
    std::fill_n(to + place(row), cells_[0], static_cast<Real>(rows_[static_cast<size_t>(row)]));
  });
}

/// Combines the values of rows of one group.
template <class Combine>
void FieldReduction::combine_rows(double first, const Combine& combine) {
  const auto for_each_group = [&](const auto& f) {
    for (int64_t z = 0; z < groups(2); ++z) {
      for (int64_t y = 0; y < groups(1); ++y)
        f(values_[static_cast<size_t>(z * groups(1) + y)], rows_.data() + z * cells_[1] + y);
    }
  };
  for_each_group([&](double& value, const double* begin) {
    value = first;
    for (int64_t k = 0; k < length(2); ++k) {
      for (int64_t j = 0; j < length(1); ++j) value = combine(value, begin[k * cells_[1] + j]);
    }
  });
  meet();
  for_each_group([&](double value, double* begin) {
    for (int64_t k = 0; k < length(2); ++k) std::fill_n(begin + k * cells_[1], length(1), finished(value));
  });
}

/// Combines the values of all subgrids.
void FieldReduction::meet() {
  if (ranks_ == nullptr) return;
  const Communicator::Axes axes{over(0), over(1), over(2)};
  if (reduce_.kind == DPDE_MEAN || reduce_.kind == DPDE_SUM) return ranks_->sum(values_, axes);
  const bool is_least = reduce_.kind == DPDE_MIN;
  for (double& value : values_) value = is_least ? -value : value;
  ranks_->largest(values_, axes);
  for (double& value : values_) value = is_least ? -value : value;
}

/// Combines row by row, one piece of the rows at a time.
template <class Real, class Combine>
void FieldReduction::reduce_across_rows(const Real* from, Real* to, double first, const Combine& combine) {
  const int64_t pieces = (cells_[0] + piece_ - 1) / piece_, tasks = pieces * groups(1) * groups(2);
  const auto combine_piece = [&](double* values, const Real* begin, int64_t width) {
    std::fill_n(values, width, first);
    for (int64_t k = 0; k < length(2); ++k) {
      for (int64_t j = 0; j < length(1); ++j) {
        const Real* row = begin + j * stride_[1] + k * stride_[2];
        for (int64_t i = 0; i < width; ++i) values[i] = combine(values[i], row[i]);
      }
    }
  };
  const auto store = [&](double* values, Real* begin, int64_t width) {
    for (int64_t i = 0; i < width; ++i) values[i] = finished(values[i]);
    for (int64_t k = 0; k < length(2); ++k) {
      for (int64_t j = 0; j < length(1); ++j)
        std::transform(values, values + width, begin + j * stride_[1] + k * stride_[2],
                       [](double v) { return static_cast<Real>(v); });
    }
  };
  const auto for_each_piece = [&](const auto& f) {
    team_.run(tasks, [&](int64_t task, int) {
      const int64_t x = task % pieces * piece_, group = task / pieces;
      const int64_t begin = x + group % groups(1) * stride_[1] + group / groups(1) * stride_[2];
      f(begin, std::min(piece_, cells_[0] - x), group * cells_[0] + x);
    });
  };
  if (ranks_ == nullptr) {
    return for_each_piece([&](int64_t begin, int64_t width, int64_t) {
      double values[widest];
      combine_piece(values, from + begin, width);
      store(values, to + begin, width);
    });
  }
  for_each_piece([&](int64_t begin, int64_t width, int64_t number) {
    combine_piece(values_.data() + number, from + begin, width);
  });
  meet();
  for_each_piece(
      [&](int64_t begin, int64_t width, int64_t number) { store(values_.data() + number, to + begin, width); });
}

}  // namespace dpde
