// SPDX-License-Identifier: Apache-2.0
#include "exec/sweep_runner.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <utility>

#include "base/aligned_memory.h"
#include "dpde/runtime/layout.h"
#include "grid/real.h"

namespace dpde {
namespace {

/// The chosen variant; the plain row if a host's own memory lacks the alignment for non-temporal stores.
const dpde_variant& code_of(const Sweep& sweep, std::span<void* const> fields) {
  const dpde_variant& chosen = sweep.code[static_cast<size_t>(sweep.tuner.choice().variant)];
  const auto is_off = [&](const SweepStream& stream) {
    void* const base = fields[static_cast<size_t>(stream.field)];
    return stream.is_written && reinterpret_cast<uintptr_t>(moved(base, stream.delta, 1)) % line_bytes != 0;
  };
  return chosen.streams != 0 && std::ranges::any_of(sweep.streams, is_off) ? sweep.code.front() : chosen;
}

/// Prefetches during a row what the hardware does not foresee: in 3-D the next row of the leading plane (measured:
/// factor 1.25 at 256^3), in 2-D the beginning of the next row of each stream (1.03 at 1024^2). Must be inlined early:
/// otherwise g++ considers a function that only prefetches to have no effect and drops its calls.
[[gnu::always_inline]] inline void prefetch_next(const Sweep& sweep, void* const* pointers, int64_t stride,
                                                 int64_t width) {
  for (size_t s : sweep.leading) {
    const char* ahead = moved(pointers[s], stride, 1);
    for (int64_t x = 0; x < sweep.count * width; x += line_bytes) __builtin_prefetch(ahead + x);
  }
  if (!sweep.leading.empty()) return;
  for (size_t s = 0; s < sweep.streams.size(); ++s) __builtin_prefetch(moved(pointers[s], stride, 1));
}

/// Advances all pointers to the next row. On short rows this counts, and g++ -O2 does not vectorise it without the
/// hint.
inline void move_all(void** pointers, size_t count, int64_t bytes) {
  auto* const addresses = reinterpret_cast<uintptr_t*>(pointers);
#pragma omp simd
  for (size_t i = 0; i < count; ++i) addresses[i] += static_cast<uintptr_t>(bytes);
}

/// Fills the halo of a row that was just written, and the rows whose mirror row it is.
inline void fill_row(const Sweep& sweep, void* const* rows, int64_t y, const double* uniforms) {
  for (const HaloFill& fill : sweep.then) {
    fill.run_row(*rows, uniforms);
    if (fill.images_are_direct()) fill.run_images(*rows, y, uniforms);
    ++rows;
  }
}

}  // namespace

SweepRunner::SweepRunner(const dpde_layout& layout, const Team& team) : layout_(&layout), team_(team) {
  callers_.resize(static_cast<size_t>(team.threads()));
}

void SweepRunner::make_room(const Sweep& sweep) {
  const auto at_least = [](auto& room, size_t size) { room.resize(std::max(room.size(), size)); };
  for (Caller& caller : callers_) {
    for (std::vector<void*>* pointers : {&caller.pointers, &caller.starts})
      at_least(*pointers, sweep.streams.size() + sweep.then.size());
  }
  at_least(grids_, sweep.grids.size());
  at_least(row_sums_, sweep.sums.size() * static_cast<size_t>(sweep.rows()));
}

void SweepRunner::run(Sweep& sweep, std::span<void* const> fields, const double* uniforms, std::span<double> sums) {
  for (size_t g = 0; g < sweep.grids.size(); ++g) {
    grids_[g] = sweep.whole_layout == nullptr ? fields[static_cast<size_t>(sweep.grids[g])] : sweep.whole_grids[g];
  }
  if (sweep.tuner.is_done()) {
    run_all_parts(sweep, fields, uniforms);
  } else {
    const auto start = std::chrono::steady_clock::now();
    run_all_parts(sweep, fields, uniforms);
    sweep.tuner.took(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  const size_t count = sweep.sums.size();
  for (size_t i = 0; i < count * static_cast<size_t>(sweep.rows()); ++i)
    sums[static_cast<size_t>(sweep.sums[i % count])] += row_sums_[i];
}

/// Runs rows and fills halos. Rows written with non-temporal stores are not in the cache: their halos are filled at the
/// end.
void SweepRunner::run_all_parts(const Sweep& sweep, std::span<void* const> fields, const double* uniforms) {
  const dpde_variant& code = code_of(sweep, fields);
  for (Caller& caller : callers_) caller.row.uniforms = uniforms;
  team_.run(sweep.parts, [&](int64_t part, int thread) { run_part(sweep, code, fields, part, thread); });
  for (const HaloFill& fill : sweep.then) {
    if (code.streams != 0) {
      fill.run(fields.data(), uniforms, team_);
      continue;
    }
    void* base = fields[static_cast<size_t>(fill.field())];
    if (!fill.images_are_direct()) fill.run_y(base, uniforms, team_);
    fill.run_z(base, uniforms, team_);
  }
}

/// Runs the rows of a plane one after the other; with several planes, the rows of the same y one after the other, so
/// that the rows above and below are still in the first-level cache. On short rows an addition counts: 2 % at 64 cells.
template <bool of_subgrid>
void SweepRunner::run_rows(const Sweep& sweep, const dpde_variant& code, Caller& caller, SweepRange y_range,
                           SweepRange planes) {
  const dpde_layout& layout = *layout_;
  const size_t streams = sweep.streams.size(), fills = sweep.then.size(), sum_count = sweep.sums.size();
  const int64_t width = real_bytes(layout), stride = layout.stride[1] * width, plane = layout.stride[2] * width;
  void** pointers = caller.pointers.data();
  for (size_t i = 0; i < streams + fills; ++i)
    pointers[i] = moved(caller.starts[i], y_range.from * stride + planes.from * plane, 1);
  dpde_row& row = caller.row;
  const bool prefetches = sweep.tuner.choice().prefetches != 0;
  for (int64_t y = y_range.from; y < y_range.to; ++y) {
    for (int64_t z = planes.from; z < planes.to; ++z) {
      row.y = of_subgrid ? y + layout.first[1] : y;
      row.z = of_subgrid ? z + layout.first[2] : z;
      row.sums =
          row_sums_.data() + static_cast<size_t>((z - sweep.z.from) * sweep.y.count() + (y - sweep.y.from)) * sum_count;
      for (size_t i = 0; i < sum_count; ++i) row.sums[i] = 0;
      if (prefetches) prefetch_next(sweep, pointers, stride, width);
      code.row(&row);
      const bool is_inside = y >= 0 && y < layout.cells[1] && z >= 0 && z < layout.cells[2];
      if (is_inside && code.streams == 0) fill_row(sweep, pointers + streams, y, row.uniforms);
      move_all(pointers, streams + fills, z + 1 < planes.to ? plane : stride - (planes.count() - 1) * plane);
    }
  }
}

/// Runs the rows of a part, on one thread.
void SweepRunner::run_part(const Sweep& sweep, const dpde_variant& code, std::span<void* const> fields, int64_t part,
                           int thread) {
  Caller& caller = callers_[static_cast<size_t>(thread)];
  void** start = caller.starts.data();
  for (const SweepStream& stream : sweep.streams)
    *start++ = moved(fields[static_cast<size_t>(stream.field)], stream.delta, 1);
  for (const HaloFill& fill : sweep.then) *start++ = fields[static_cast<size_t>(fill.field())];
  caller.row.streams = caller.pointers.data();
  caller.row.grids = grids_.data();
  caller.row.layout = sweep.whole_layout == nullptr ? layout_ : sweep.whole_layout;
  caller.row.own = caller.row.uniforms + sweep.own;
  caller.row.count = sweep.count;
  caller.row.first = sweep.first + layout_->first[0];
  SweepRange y = sweep.y, z = sweep.z;
  SweepRange& split = sweep.splits_z ? z : y;
  const SweepRange whole = split;
  split = {whole.from + whole.count() * part / sweep.parts, whole.from + whole.count() * (part + 1) / sweep.parts};
  const auto [rows, planes] = std::pair(sweep.tuner.choice().tile, sweep.tuner.choice().planes);
  for (int64_t from = y.from; from < y.to; from += rows) {
    const SweepRange tile{from, std::min(from + rows, y.to)};
    for (int64_t place = z.from; place < z.to; place += planes) {
      const SweepRange levels{place, std::min(place + planes, z.to)};
      is_divided(*layout_) ? run_rows<true>(sweep, code, caller, tile, levels)
                           : run_rows<false>(sweep, code, caller, tile, levels);
    }
  }
  if (code.streams != 0) std::atomic_thread_fence(std::memory_order_seq_cst);  // non-temporal stores are not ordered
}

}  // namespace dpde
