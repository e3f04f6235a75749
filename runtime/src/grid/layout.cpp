// SPDX-License-Identifier: Apache-2.0
// Strides of a grid; layout.h lists their properties. All products are checked for overflow before use.
#include "dpde/runtime/layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "base/aligned_memory.h"
#include "dpde/runtime/error.h"

namespace dpde {
namespace {

constexpr int64_t most_elements = int64_t{1} << 44;      // 128 TiB of doubles: beyond every machine, far from overflow
constexpr int64_t most_single_cells = int64_t{1} << 24;  // integers that a float represents exactly

[[noreturn]] void too_large(std::span<const int64_t> cells) {
  throw Error(ErrorKind::machine,
              fmt::format("a grid of {} cells is larger than this machine can address", fmt::join(cells, " x ")));
}

void check(std::span<const int64_t> cells, const std::array<int64_t, 3>& halo, int32_t real) {
  if (cells.empty() || cells.size() > DPDE_MAX_RANK) {
    throw Error(ErrorKind::input, fmt::format("a grid has 1 to 3 axes, not {}", cells.size()));
  }
  for (size_t axis = 0; axis < cells.size(); ++axis) {
    if (cells[axis] < 1)
      throw Error(ErrorKind::input,
                  fmt::format("axis {} has {} cells; at least 1 is needed", "xyz"[axis], cells[axis]));
    if (halo[axis] < 0)
      throw Error(ErrorKind::input, fmt::format("axis {} has a halo of {} cells", "xyz"[axis], halo[axis]));
    if (cells[axis] > most_elements || halo[axis] > most_elements) too_large(cells);
    if (real == DPDE_F32 && cells[axis] > most_single_cells) {
      throw Error(ErrorKind::input, fmt::format("axis {} has {} cells; single precision tells {} of them apart",
                                                "xyz"[axis], cells[axis], most_single_cells));
    }
  }
}

}  // namespace

dpde_layout make_layout(std::span<const int64_t> cells, const std::array<int64_t, 3>& halo, int32_t real) {
  check(cells, halo, real);
  dpde_layout layout{};
  layout.rank = static_cast<int32_t>(cells.size());
  layout.real = real;
  for (size_t axis = 0; axis < DPDE_MAX_RANK; ++axis) {
    layout.cells[axis] = axis < cells.size() ? cells[axis] : 1;
    layout.halo[axis] = axis < cells.size() ? halo[axis] : 0;
    layout.global[axis] = layout.cells[axis];
  }
  const auto times = [&](int64_t a, int64_t b) {
    int64_t product = 0;
    if (__builtin_mul_overflow(a, b, &product) || product > most_elements) too_large(cells);
    return product;
  };
  const int64_t lane = line_bytes / real_bytes(layout), page = page_bytes / real_bytes(layout);
  const auto round_up = [lane](int64_t value) { return (value + lane - 1) / lane * lane; };
  const auto staggered = [lane, page](int64_t stride) { return stride % page == 0 ? stride + lane : stride; };
  const int64_t margin = round_up(std::max(layout.halo[0], lane));
  const int64_t row = round_up(layout.cells[0]) + 2 * margin;
  layout.stride[0] = 1;
  layout.stride[1] = cells.size() > 1 ? staggered(row) : row;
  layout.stride[2] = times(layout.stride[1], layout.cells[1] + 2 * layout.halo[1]);
  if (cells.size() > 2) layout.stride[2] = staggered(layout.stride[2]);
  layout.size = times(layout.stride[2], layout.cells[2] + 2 * layout.halo[2]) +
                2 * lane;  // so that rows can be read in whole vectors
  layout.origin = lane + margin + layout.halo[1] * layout.stride[1] + layout.halo[2] * layout.stride[2];
  return layout;
}

dpde_layout make_subgrid(std::span<const int64_t> global, const std::array<int64_t, 3>& ranks,
                         const std::array<int64_t, 3>& place, const std::array<int64_t, 3>& halo, int32_t real) {
  check(global, halo, real);
  std::array<int64_t, 3> first{}, cells{1, 1, 1};
  for (size_t axis = 0; axis < global.size(); ++axis) {
    first[axis] = global[axis] * place[axis] / ranks[axis];
    cells[axis] = global[axis] * (place[axis] + 1) / ranks[axis] - first[axis];
    const int64_t least = global[axis] / ranks[axis];  // the same on all ranks, so all of them throw if one has too few
    if (ranks[axis] == 1 || least >= std::max<int64_t>(halo[axis], 1)) continue;
    throw Error(ErrorKind::input,
                fmt::format("axis {} of {} cells is divided among {} ranks: {} cells for one of them, fewer than its "
                            "halo of {}",
                            "xyz"[axis], global[axis], ranks[axis], least, halo[axis]));
  }
  dpde_layout layout = make_layout(std::span(cells).first(global.size()), halo, real);
  for (size_t axis = 0; axis < global.size(); ++axis) {
    layout.global[axis] = global[axis];
    layout.first[axis] = first[axis];
  }
  return layout;
}

int64_t cell_count(const dpde_layout& layout) { return layout.cells[0] * layout.cells[1] * layout.cells[2]; }

int64_t global_cell_count(const dpde_layout& layout) { return layout.global[0] * layout.global[1] * layout.global[2]; }

int64_t field_bytes(const dpde_layout& layout) { return layout.size * real_bytes(layout); }

}  // namespace dpde
