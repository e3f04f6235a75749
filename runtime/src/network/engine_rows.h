// SPDX-License-Identifier: Apache-2.0
// Shared helpers of the engine.
#pragma once

#include "grid/real.h"
#include "network/view.h"

namespace dpde::nn {

/// Calls `f(channel, row)` for all rows of a shape; `cost` of a cell in tenths of a nanosecond, approximately.
template <class F>
void for_each_row_of(const Team& team, const Shape& shape, int64_t cost, const F& f) {
  const int64_t rows = shape.rows(), all = shape.channels * rows;
  parallel_pieces(team, all, 1, all * shape.cells[0] * cost / 10, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) f(i / rows, i % rows);
  });
}

/// Calls `f(base)` with the element type of a field.
template <class F>
void with_field(int32_t real, void* base, const F& f) {
  with_real(real, [&](auto value) { f(static_cast<decltype(value)*>(base)); });
}

}  // namespace dpde::nn
