// SPDX-License-Identifier: Apache-2.0
#include "wavefront.h"

#include <omp.h>

#include <algorithm>
#include <array>
#include <utility>

#include "aligned_memory.h"
#include "fill.h"

namespace dpde {
namespace {

using Kind = WavefrontStream::Kind;

constexpr int64_t line = 8;                     // elements of a cache line
constexpr int64_t tile_bytes = 768 * 1024;      // 3-D: what the rings of a tile may take, to stay near the core
constexpr int64_t least_rows_of_tile = 8;

struct Range {
  int64_t from = 0, to = 1;
};
/// Place of a row.
struct Place {
  int64_t y = 0, z = 0;
};

/// Into 0 .. cells - 1 from at most one period away.
int64_t wrapped(int64_t place, int64_t cells) { return place < 0 ? place + cells : place >= cells ? place - cells : place; }

/// Rings and pointers of one thread.
struct Rings {
  std::unique_ptr<double, decltype(&std::free)> memory{nullptr, &std::free};
  std::vector<double*> base;  // of each ring: cell 0 of the first row of slot 0
  std::vector<double*> pointers;
  int64_t first_y = 0;  // 3-D: y of the first row of a slot
};

}  // namespace

struct Wavefront::Impl {
  Impl(const Executor& from, WavefrontPlan made, int threads);
  void make_fills();
  void make_tiles(int threads);
  void allocate(Rings& rings) const;
  void run_tile(Rings& rings, Range tile) const;
  void run_slab(size_t number, Rings& rings, Range tile, int64_t slab) const;
  void run_row(size_t number, Rings& rings, Place place) const;
  void image_slab(size_t number, Rings& rings, Range tile, int64_t slab) const;
  void image_rows(size_t number, Rings& rings, size_t axis, Place from, int64_t to) const;
  double* row_of(const WavefrontStream& stream, const Rings& rings, Place place) const;
  Range rows(const WavefrontLevel& level, size_t axis, Range tile) const;
  Range rows_y(const WavefrontLevel& level, Range tile) const { return rank == 3 ? rows(level, 0, tile) : Range{}; }
  int64_t cells(size_t axis) const { return layout.cells[axis + 1]; }
  int64_t halo(size_t axis) const { return layout.halo[axis + 1]; }
  bool is_bounded(size_t axis) const { return !plan.periodic[axis + 1]; }

  const Executor* executor;
  dpde_layout layout;
  WavefrontPlan plan;
  int rank;
  size_t last;                 // the last axis: 0 is y, 1 is z
  std::vector<std::vector<HaloFill>> fills;   // of each level's outputs
  std::vector<std::vector<double>> uniforms;  // of each step
  std::vector<Range> tiles;                   // along y
  int64_t rows_before = 0, slot_rows = 1;     // 3-D: rows of a slot before the tile's first, and in all
  int64_t slot_size = 0;
  std::vector<Rings> rings_of_threads;
  std::span<double* const> results;
};

Wavefront::Impl::Impl(const Executor& from, WavefrontPlan made, int threads)
    : executor(&from), layout(from.layout()), plan(std::move(made)), rank(layout.rank), last(rank == 3 ? 1 : 0) {
  make_fills();
  uniforms.assign(static_cast<size_t>(plan.steps), std::vector<double>(static_cast<size_t>(from.program().uniform_count)));
  make_tiles(threads);
  rings_of_threads.resize(static_cast<size_t>(std::min<int64_t>(threads, static_cast<int64_t>(tiles.size()))));
  for (Rings& rings : rings_of_threads) allocate(rings);
}

void Wavefront::Impl::make_fills() {
  for (const WavefrontLevel& level : plan.levels) {
    fills.emplace_back();
    for (const WavefrontLevel::Output& output : level.outputs) fills.back().push_back(output.fill ? HaloFill(*output.fill, layout) : HaloFill());
  }
}

/// Tiles along y: one a thread in 2-D; in 3-D as many rows as keep the rings of all levels near the core.
void Wavefront::Impl::make_tiles(int threads) {
  int64_t before = 0, after = 0;
  for (const WavefrontLevel& level : plan.levels) {
    before = std::max(before, level.below[0]);
    after = std::max(after, level.above[0]);
  }
  const int64_t ny = layout.cells[1];
  int64_t count = std::min<int64_t>(threads, ny);
  if (rank == 3) {
    int64_t slots = 0;
    for (const int64_t ring : plan.ring_slots) slots += ring;
    const int64_t fitting = tile_bytes / (slots * layout.stride[1] * static_cast<int64_t>(sizeof(double))) - before - after;
    const int64_t rows = std::max(fitting, least_rows_of_tile);
    count = (ny + rows - 1) / rows;
    count = std::min((count + threads - 1) / threads * threads, ny);
    rows_before = before + layout.halo[1];
    slot_rows = (ny + count - 1) / count + before + after + 2 * layout.halo[1];
  }
  for (int64_t t = 0; t < count; ++t) tiles.push_back({ny * t / count, ny * (t + 1) / count});
  slot_size = slot_rows * layout.stride[1];
}

void Wavefront::Impl::allocate(Rings& rings) const {
  const int64_t margin = layout.origin - layout.halo[1] * layout.stride[1] - layout.halo[2] * layout.stride[2];
  int64_t elements = 0;
  for (const int64_t slots : plan.ring_slots) elements += slots * slot_size + 5 * line;
  rings.memory.reset(allocate_doubles(elements + 2 * margin));
  double* next = rings.memory.get() + margin;
  for (const int64_t slots : plan.ring_slots) {
    rings.base.push_back(next);
    next += slots * slot_size + 5 * line;
  }
  size_t most = 0;
  for (const WavefrontLevel& level : plan.levels) most = std::max(most, level.streams.size());
  rings.pointers.assign(most, nullptr);
}

double* Wavefront::Impl::row_of(const WavefrontStream& stream, const Rings& rings, Place place) const {
  int64_t y = place.y + stream.y, z = place.z + stream.z;
  if (stream.kind == Kind::ring) {
    const int64_t slot = (rank == 3 ? z : y) & (plan.ring_slots[static_cast<size_t>(stream.index)] - 1);
    const int64_t row = rank == 3 ? y - rings.first_y : 0;
    return rings.base[static_cast<size_t>(stream.index)] + slot * slot_size + row * layout.stride[1] + stream.x;
  }
  if (plan.periodic[1]) y = wrapped(y, layout.cells[1]);
  if (plan.periodic[2]) z = wrapped(z, layout.cells[2]);
  double* base = stream.kind == Kind::input ? executor->bound(stream.index) : results[static_cast<size_t>(stream.index)];
  return base + y * layout.stride[1] + z * layout.stride[2] + stream.x;
}

/// Rows (planes) along an axis that a level computes for a tile.
Range Wavefront::Impl::rows(const WavefrontLevel& level, size_t axis, Range tile) const {
  Range range{tile.from - level.below[axis], tile.to + level.above[axis]};
  if (is_bounded(axis)) range = {std::max<int64_t>(range.from, 0), std::min(range.to, cells(axis))};
  return range;
}

void Wavefront::Impl::run_row(size_t number, Rings& rings, Place place) const {
  const WavefrontLevel& level = plan.levels[number];
  for (size_t s = 0; s < level.streams.size(); ++s) rings.pointers[s] = row_of(level.streams[s], rings, place);
  dpde_row row{};
  row.streams = rings.pointers.data();
  row.uniforms = uniforms[static_cast<size_t>(level.step)].data();
  row.count = layout.cells[0];
  row.y = plan.periodic[1] ? wrapped(place.y, layout.cells[1]) : place.y;
  row.z = plan.periodic[2] ? wrapped(place.z, layout.cells[2]) : place.z;
  row.layout = &layout;
  level.row(&row);
  for (size_t o = 0; o < level.outputs.size(); ++o) {
    if (level.outputs[o].filled) fills[number][o].run_row(row_of(level.outputs[o].stream, rings, place), row.uniforms);
  }
}

/// Row `from`, complete with its ends, as its image at place `to` along an axis.
void Wavefront::Impl::image_rows(size_t number, Rings& rings, size_t axis, Place from, int64_t to) const {
  const WavefrontLevel& level = plan.levels[number];
  const double* values = uniforms[static_cast<size_t>(level.step)].data();
  Place target = from;
  (axis == 0 ? target.y : target.z) = to;
  for (const WavefrontLevel::Output& output : level.outputs) {
    if (!output.filled) continue;
    const dpde_boundary& sides = output.fill->axes[axis + 1];
    const int32_t kind = to < 0 ? sides.low : sides.high;
    const int32_t uniform = to < 0 ? sides.value_low : sides.value_high;
    const double twice = kind == DPDE_VALUE && uniform >= 0 ? 2 * values[uniform] : 0;
    const double* source = row_of(output.stream, rings, from);
    double* image = row_of(output.stream, rings, target);
    const int64_t first = -layout.halo[0], end = layout.cells[0] + layout.halo[0];
    if (kind == DPDE_VALUE) {
      for (int64_t x = first; x < end; ++x) image[x] = twice - source[x];
    } else {
      std::copy(source + first, source + end, image + first);
    }
  }
}

/// Images of a row (plane) beyond the walls of the last axis: those below with their row, those above when all are there.
void Wavefront::Impl::image_slab(size_t number, Rings& rings, Range tile, int64_t slab) const {
  if (!is_bounded(last)) return;
  Range y = rows_y(plan.levels[number], tile);
  if (rank == 3 && is_bounded(0)) y = {y.from - (y.from == 0 ? halo(0) : 0), y.to + (y.to == cells(0) ? halo(0) : 0)};
  const int64_t n = cells(last);
  const auto image = [&](int64_t from, int64_t to) {
    if (rank == 2) return image_rows(number, rings, 0, {from, 0}, to);
    for (int64_t row = y.from; row < y.to; ++row) image_rows(number, rings, 1, {row, from}, to);
  };
  if (slab < halo(last)) image(slab, -1 - slab);
  for (int64_t k = 0; slab == n - 1 && k < halo(last); ++k) image(n - 1 - k, n + k);
}

void Wavefront::Impl::run_slab(size_t number, Rings& rings, Range tile, int64_t slab) const {
  if (rank == 2) {
    run_row(number, rings, {slab, 0});
  } else {
    const Range y = rows_y(plan.levels[number], tile);
    for (int64_t row = y.from; row < y.to; ++row) {
      run_row(number, rings, {row, slab});
      if (!is_bounded(0)) continue;
      if (row < halo(0)) image_rows(number, rings, 0, {row, slab}, -1 - row);
      if (row >= cells(0) - halo(0)) image_rows(number, rings, 0, {row, slab}, 2 * cells(0) - 1 - row);
    }
  }
  image_slab(number, rings, tile, slab);
}

void Wavefront::Impl::run_tile(Rings& rings, Range tile) const {
  rings.first_y = tile.from - rows_before;
  const Range slabs = rank == 3 ? Range{0, layout.cells[2]} : tile;
  int64_t from = slabs.from, to = slabs.to;
  for (const WavefrontLevel& level : plan.levels) {
    const Range range = rows(level, last, slabs);
    from = std::min(from, range.from + level.lag);
    to = std::max(to, range.to + level.lag);
  }
  for (int64_t place = from; place < to; ++place) {
    for (size_t number = 0; number < plan.levels.size(); ++number) {
      const WavefrontLevel& level = plan.levels[number];
      const Range range = rows(level, last, slabs);
      const int64_t slab = place - level.lag;
      if (slab >= range.from && slab < range.to) run_slab(number, rings, tile, slab);
    }
  }
}

std::optional<Wavefront> Wavefront::make(const Executor& executor, int steps, int threads) {
  std::optional<WavefrontPlan> plan = plan_wavefront(executor.program(), executor.layout(), steps);
  if (!plan) return std::nullopt;
  return Wavefront(std::make_unique<Impl>(executor, std::move(*plan), std::max(threads, 1)));
}

Wavefront::Wavefront(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Wavefront::~Wavefront() = default;
Wavefront::Wavefront(Wavefront&&) noexcept = default;
Wavefront& Wavefront::operator=(Wavefront&&) noexcept = default;

int Wavefront::steps() const { return impl_->plan.steps; }

int64_t Wavefront::ring_bytes() const {
  int64_t slots = 0;
  for (const int64_t ring : impl_->plan.ring_slots) slots += ring;
  return slots * impl_->slot_size * static_cast<int64_t>(sizeof(double));
}

void Wavefront::set_uniforms(int step, std::span<const double> uniforms) {
  std::ranges::copy(uniforms, impl_->uniforms[static_cast<size_t>(step)].begin());
}

void Wavefront::run(std::span<double* const> results) {
  Impl& impl = *impl_;
  impl.results = results;
  const int threads = static_cast<int>(impl.rings_of_threads.size());
  const auto run_part = [&](int part) {
    for (size_t t = static_cast<size_t>(part); t < impl.tiles.size(); t += static_cast<size_t>(threads)) {
      impl.run_tile(impl.rings_of_threads[static_cast<size_t>(part)], impl.tiles[t]);
    }
  };
  if (threads == 1) {
    run_part(0);
  } else {
#pragma omp parallel num_threads(threads)
    for (int part = omp_get_thread_num(); part < threads; part += omp_get_num_threads()) run_part(part);
  }
  const std::vector<double>& last_uniforms = impl.uniforms.back();
  for (size_t number = 0; number < impl.plan.levels.size(); ++number) {
    const WavefrontLevel& level = impl.plan.levels[number];
    for (size_t o = 0; o < level.outputs.size(); ++o) {
      const WavefrontLevel::Output& output = level.outputs[o];
      if (output.stream.kind != Kind::result || !output.filled) continue;
      double* base = results[static_cast<size_t>(output.stream.index)];
      impl.fills[number][o].run_y(base, last_uniforms.data());
      impl.fills[number][o].run_z(base, last_uniforms.data());
    }
  }
}

}  // namespace dpde
