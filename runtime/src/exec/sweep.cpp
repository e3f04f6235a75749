// SPDX-License-Identifier: Apache-2.0
#include "exec/sweep.h"

#include <algorithm>
#include <utility>

#include "dpde/runtime/layout.h"
#include "grid/real.h"

namespace dpde {
namespace {

constexpr int64_t plane_bytes = 640 * 1024;                    // of one plane of a tile
constexpr int64_t parts_per_thread = 4;                        // so that a late thread delays the end only a little
constexpr int64_t least_bytes_for_prefetch = 4 * 1024 * 1024;  // of a field: smaller ones stay in the core's caches
constexpr int64_t least_tile = 8;                              // rows

std::vector<size_t> leading_streams(const dpde_kernel& kernel) {
  std::vector<size_t> leading;
  for (int s = 0; s < kernel.stream_count; ++s) {
    const dpde_stream& stream = kernel.streams[s];
    const auto is_ahead_of = [&](const dpde_stream& other) {
      return std::pair(stream.offset[2], stream.offset[1]) > std::pair(other.offset[2], other.offset[1]);
    };
    const auto same_field = [&](size_t other) { return kernel.streams[other].field == stream.field; };
    const auto found = std::ranges::find_if(leading, same_field);
    if (found == leading.end()) {
      if (stream.offset[2] > 0) leading.push_back(static_cast<size_t>(s));
    } else if (is_ahead_of(kernel.streams[*found])) {
      *found = static_cast<size_t>(s);
    }
  }
  return leading;
}

/// For fields larger than the core's own cache, the fastest variant depends on the machine.
SweepTuner make_tuner(const Sweep& sweep, const dpde_layout& layout) {
  const bool is_large = field_bytes(layout) >= least_bytes_for_prefetch;
  const int64_t plane_fields = std::max<int64_t>(1, is_large ? static_cast<int64_t>(sweep.leading.size()) : 0);
  const bool has_tiles = sweep.z.count() > 1 && !sweep.ordered;
  const auto ahead = std::ranges::find_if(
      sweep.code, [](const dpde_variant& variant) { return variant.ahead != 0 && variant.streams == 0; });
  const bool begins_ahead = is_large && layout.rank > 1 && ahead != sweep.code.end();
  SweepChoice first{begins_ahead ? ahead - sweep.code.begin() : 0, is_large ? 1 : 0, sweep.y.count()};
  if (has_tiles)
    first.tile = std::min(sweep.y.count(),
                          std::max(least_tile, plane_bytes / (layout.stride[1] * real_bytes(layout) * plane_fields)));
  std::vector<SweepTuner::Move> moves;
  if (!is_large || sweep.ordered || layout.rank == 1) return {first, {}};
  for (size_t v = 0; v < sweep.code.size(); ++v) {
    const auto number = static_cast<int64_t>(v);
    if (number != first.variant && (sweep.code[v].streams == 0 || sweep.first == 0))
      moves.push_back({&SweepChoice::variant, number});
  }
  moves.push_back({&SweepChoice::prefetches, 0});
  if (has_tiles) moves.push_back({&SweepChoice::planes, 2});
  if (has_tiles && first.tile / 2 >= least_tile) moves.push_back({&SweepChoice::tile, first.tile / 2});
  if (has_tiles && first.tile < sweep.y.count()) moves.push_back({&SweepChoice::tile, 2 * first.tile});
  return {first, std::move(moves)};
}

/// Cells beyond a subdomain interface are computed by the neighbour.
SweepRange region_along(size_t axis, const dpde_operation& operation, const dpde_layout& layout) {
  const int64_t grow = operation.grow[axis];
  return {has_low_seam(layout, axis) ? 0 : -grow, layout.cells[axis] + (has_high_seam(layout, axis) ? 0 : grow)};
}

}  // namespace

void Sweep::read_whole(const WholeFields& fields) {
  whole_layout = &fields.layout();
  for (size_t g = 0; g < grids.size(); ++g) whole_grids.push_back(fields.base(g));
}

Sweep make_sweep(const dpde_program& program, const dpde_operation& operation, const dpde_layout& layout, int threads) {
  const dpde_kernel& kernel = program.kernels[operation.kernel];
  Sweep sweep;
  sweep.code = {{kernel.row, 0, 0}};
  sweep.code.insert(sweep.code.end(), kernel.variants, kernel.variants + kernel.variant_count);
  sweep.own = kernel.own;
  const SweepRange x = region_along(0, operation, layout);
  sweep.first = x.from;
  sweep.count = x.count();
  sweep.y = region_along(1, operation, layout);
  sweep.z = region_along(2, operation, layout);
  for (int s = 0; s < kernel.stream_count; ++s) {
    const dpde_stream& stream = kernel.streams[s];
    int64_t delta = sweep.first + stream.offset[0];
    for (int axis = 1; axis < layout.rank; ++axis) delta += stream.offset[axis] * layout.stride[axis];
    sweep.streams.push_back({stream.field, delta * real_bytes(layout), stream.is_written != 0});
  }
  for (int g = 0; g < kernel.grid_count; ++g) sweep.grids.push_back(kernel.grids[g].field);
  sweep.sums.assign(kernel.sums, kernel.sums + kernel.sum_count);
  // On a subgrid they are separate operations.
  for (int f = 0; f < operation.then_count && !is_divided(layout); ++f)
    sweep.then.emplace_back(operation.then[f], layout);
  sweep.ordered = operation.serial != 0;
  sweep.leading = leading_streams(kernel);
  sweep.tuner = make_tuner(sweep, layout);
  const bool worth = sweep.rows() > 1 && sweep.rows() * sweep.count >= least_cells_for_threads;
  if (threads > 1 && worth && !sweep.ordered) {
    sweep.splits_z = sweep.z.count() >= threads;
    sweep.parts = std::min(parts_per_thread * threads, sweep.splits_z ? sweep.z.count() : sweep.y.count());
  }
  return sweep;
}

}  // namespace dpde
