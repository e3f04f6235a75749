// SPDX-License-Identifier: Apache-2.0
// Sums of adjoints in a wavefront: over all cells, and of results over the steps. Tiles recompute cells of their
// neighbours, which must not count twice.
#include <algorithm>
#include <cstring>

#include "wavefront/wavefront_impl.h"

namespace dpde {

using wavefront::contains;

/// Strips do not depend on the number of threads, and so neither does the order in which sums of rows are added.
void Wavefront::Impl::make_sums() {
  int64_t count = 0;
  for (const WavefrontLevel& level : plan.levels) {
    first_row_sum.push_back(count);
    count += static_cast<int64_t>(level.sums.size()) * strips * layout.cells[1] * layout.cells[2];
  }
  row_sums.assign(static_cast<size_t>(count), 0.0);
}

/// Only the tile's own cells count, so a row that extends beyond them is called in pieces.
void Wavefront::Impl::call_with_sums(const WavefrontLevel& level, Rings& rings, dpde_row row, const Tile& tile,
                                     const Place& place) {
  const bool is_own = contains(tile[1], place[1]) && contains(tile[2], place[2]);
  const int64_t first = row.first, end = row.first + row.count;
  const int64_t own_from = is_own ? std::max(first, tile[0].from) : end,
                own_to = is_own ? std::min(end, tile[0].to) : end;
  const size_t count = level.sums.size();
  void* const* streams = row.streams;
  const int64_t strip = (&tile - tiles.data()) % strips;
  double* own = row_sums.data() + first_row_sum[static_cast<size_t>(&level - plan.levels.data())];
  const auto piece = [&](int64_t from, int64_t to, double* into) {
    if (from >= to) return;
    for (size_t s = 0; s < level.streams.size(); ++s) rings.pieces[s] = moved(streams[s], from - first, width);
    row.streams = rings.pieces.data();
    row.first = from;
    row.count = to - from;
    row.sums = into;
    std::fill_n(into, count, 0.0);
    level.row(&row);
  };
  piece(first, own_from, rings.unused_sums.data());
  if (is_own)
    piece(own_from, own_to,
          own + ((strip * layout.cells[2] + place[2]) * layout.cells[1] + place[1]) * static_cast<int64_t>(count));
  piece(own_to, end, rings.unused_sums.data());
}

/// Adds results to sums over the steps, or copies them out of rings; each cell belongs to one tile.
void Wavefront::Impl::keep_outputs(const WavefrontLevel& level, const Rings& rings, const Tile& tile,
                                   const Place& place) const {
  if (!contains(tile[1], place[1]) || !contains(tile[2], place[2])) return;
  for (const WavefrontLevel::Output& output : level.outputs) {
    if (output.copied >= 0) {
      char* to = moved(results[static_cast<size_t>(output.copied)],
                       tile[0].from + place[1] * layout.stride[1] + place[2] * layout.stride[2], width);
      std::memcpy(to, row_of(output.stream, rings, place) + tile[0].from * width,
                  static_cast<size_t>(tile[0].count() * width));
    }
    if (output.added < 0) continue;
    double* to = totals[static_cast<size_t>(output.added)] + place[1] * layout.stride[1] + place[2] * layout.stride[2];
    with_real(layout.real, [&](auto real) {
      const auto* from =
          static_cast<const decltype(real)*>(static_cast<const void*>(row_of(output.stream, rings, place)));
#pragma omp simd
      for (int64_t x = tile[0].from; x < tile[0].to; ++x) to[x] += from[x];
    });
  }
}

void Wavefront::Impl::add_sums() {
  for (std::vector<double>& of_pass : sums) std::ranges::fill(of_pass, 0.0);
  for (size_t number = 0; number < plan.levels.size(); ++number) {
    const WavefrontLevel& level = plan.levels[number];
    const auto count = static_cast<int64_t>(level.sums.size());
    std::vector<double>& into = sums[static_cast<size_t>(level.pass)];
    const double* from = row_sums.data() + first_row_sum[number];
    for (int64_t i = 0; i < count * strips * layout.cells[1] * layout.cells[2]; ++i)
      into[static_cast<size_t>(level.sums[static_cast<size_t>(i % count)])] += from[i];
  }
}

}  // namespace dpde
