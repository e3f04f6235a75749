// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstring>
#include <utility>

#include "base/aligned_memory.h"
#include "dpde/runtime/float_mode.h"
#include "wavefront/wavefront_impl.h"

namespace dpde {

using wavefront::Access, wavefront::Place, wavefront::Range, wavefront::Rings, wavefront::Tile, wavefront::wrapped;

namespace {

using Kind = WavefrontStream::Kind;

/// Memory for the rings of a tile, measured on Zen 5 (1 MiB of second-level cache a core, 32 MiB of third). 2-D strips
/// are fastest if they fit the core's own cache; slightly exceeding it is better than one more strip. Planes of 3-D
/// grids with many steps are fastest in the shared cache (256^3: 1.2 times the speed of the plain sweep, otherwise
/// 0.9).
constexpr int64_t strip_bytes = 1040 * 1024, tile_bytes = 6 * 1024 * 1024;
constexpr int64_t least_strip = 128, least_rows = 8;

std::vector<Range> split(int64_t cells, int64_t parts, int64_t multiple) {
  std::vector<Range> ranges;
  for (int64_t p = 0, from = 0; p < parts && from < cells; ++p) {
    const int64_t share = (cells - from + parts - p - 1) / (parts - p);
    const int64_t to = p + 1 == parts ? cells : std::min(cells, from + (share + multiple - 1) / multiple * multiple);
    ranges.push_back({from, to});
    from = to;
  }
  return ranges;
}

}  // namespace

Wavefront::Impl::Impl(std::array<const Executor*, 2> from, WavefrontPlan made, const Team& threads)
    : team(threads),
      executors(from),
      layout(from[0]->layout()),
      plan(std::move(made)),
      last(static_cast<size_t>(layout.rank) - 1),
      width(real_bytes(layout)),
      line(line_bytes / width) {
  for (const WavefrontLevel& level : plan.levels) {
    fills.emplace_back();
    for (const WavefrontLevel::Output& output : level.outputs)
      fills.back().push_back(output.fill ? HaloFill(*output.fill, layout) : HaloFill());
  }
  for (const WavefrontPass& pass : plan.passes) {
    const dpde_program& program = executors[static_cast<size_t>(pass.program)]->program();
    sums.emplace_back(static_cast<size_t>(program.sum_count));
  }
  for (const WavefrontUniforms& each : plan.uniforms) {
    const int program = plan.passes[static_cast<size_t>(each.pass)].program;
    uniforms.emplace_back(static_cast<size_t>(executors[static_cast<size_t>(program)]->program().uniform_count));
  }
  make_tiles(team.threads());
  make_sums();
  rings_of_threads.resize(static_cast<size_t>(std::min<int64_t>(team.threads(), static_cast<int64_t>(tiles.size()))));
  for (Rings& rings : rings_of_threads) allocate(rings);
}

int64_t Wavefront::Impl::slots() const {
  int64_t total = 0;
  for (const int64_t count : plan.ring_slots) total += count;
  return total;
}

/// 2-D: strips along x whose rings fit the core's cache, a part of y for each thread. 3-D: tiles along y.
void Wavefront::Impl::make_tiles(int threads) {
  const int64_t fitting =
      (last == 1 ? strip_bytes : tile_bytes) / (std::max<int64_t>(slots(), 1) * width);  // cells of a slot
  const auto [nx, ny, nz] = std::array{layout.cells[0], layout.cells[1], layout.cells[2]};
  const int64_t most_parts = std::max<int64_t>(ny / std::max<int64_t>(layout.halo[1], 1),
                                               1);  // mirror rows of rows beyond a wall belong to the same tile
  int64_t parts = std::min<int64_t>(threads, most_parts);
  if (last == 1) {
    const int64_t strip = std::max(fitting - 2 * strip_margin(), least_strip);
    if (nx >= strip_margin() + layout.halo[0]) strips = (nx + strip - 1) / strip;
  } else {
    const int64_t rows = std::max(fitting / layout.stride[1] - 2 * plan.reach(1), least_rows);
    parts = std::min(((ny + rows - 1) / rows + threads - 1) / threads * threads, most_parts);
  }
  for (const Range& y : split(ny, parts, 1)) {
    for (const Range& x : split(nx, strips, 2 * line)) tiles.push_back({x, y, Range{0, nz}});
  }
  strips = static_cast<int64_t>(split(nx, strips, 2 * line).size());
  splits_x = tiles.front()[0].count() < nx;
  Tile widest = tiles.front();
  for (const Tile& tile : tiles) {
    for (size_t axis = 0; axis < 3; ++axis)
      widest[axis] = tile[axis].count() > widest[axis].count() ? tile[axis] : widest[axis];
  }
  for (size_t axis = 0; axis < 2; ++axis) {
    if (axis >= last) continue;
    const int64_t margin = layout.halo[axis] + (axis == 1 ? plan.reach(1) : splits_x ? strip_margin() : 0);
    before[axis] = axis == 0 ? round_up(std::max(margin, line)) : margin;
    extent[axis] =
        axis == 0 ? before[0] + round_up(widest[0].count() + std::max(margin, line)) : widest[1].count() + 2 * margin;
  }
  slot_size = extent[0] * extent[1] + (extent[0] * extent[1] * width % page_bytes == 0 ? line : 0);
}

void Wavefront::Impl::allocate(Rings& rings) const {
  int64_t count = slots();
  for (const WavefrontCopy& copy : plan.copies) count += splits_x ? copy.slots : 0;
  const int64_t apart = 5 * line;  // so that rings start at different positions modulo 4 KiB
  rings.memory =
      Buffer((count * slot_size + static_cast<int64_t>(plan.ring_slots.size() + plan.copies.size()) * apart) * width);
  char* next = rings.memory.data();
  const auto place = [&](int64_t ring_slots) {
    rings.base.push_back(next);
    next += (ring_slots * slot_size + apart) * width;
  };
  for (const int64_t ring_slots : plan.ring_slots) place(ring_slots);
  for (const WavefrontCopy& copy : plan.copies) place(splits_x ? copy.slots : 0);
  size_t most = 0, most_sums = 0;
  for (const WavefrontLevel& level : plan.levels) {
    most = std::max(most, level.streams.size());
    most_sums = std::max(most_sums, level.sums.size());
    rings.accesses.emplace_back(level.streams.size());
  }
  rings.regions.resize(plan.levels.size());
  rings.rows.resize(plan.levels.size());
  rings.pointers.assign(most, nullptr);
  rings.pieces.assign(most, nullptr);
  rings.unused_sums.assign(most_sums, 0.0);
  rings.slabs.assign(most, nullptr);
}

/// Pointer to cell x = 0 of a row in a ring.
char* Wavefront::Impl::ring_row(size_t ring, int64_t slots, const Rings& rings, const Place& place) const {
  const int64_t slot = place[last] & (slots - 1);
  const int64_t row = last == 2 ? place[1] - rings.first[1] : 0;
  return rings.base[ring] + (slot * slot_size + row * extent[0] - rings.first[0]) * width;
}

/// Pointer to cell x = 0 of a row of an output.
char* Wavefront::Impl::row_of(const WavefrontStream& output, const Rings& rings, const Place& place) const {
  const auto index = static_cast<size_t>(output.index);
  if (output.kind == Kind::ring) return ring_row(index, plan.ring_slots[index], rings, place);
  return moved(results[index], place[1] * layout.stride[1] + place[2] * layout.stride[2], width);
}

/// The cells that a level computes for a tile. For levels that only other levels read, strips begin and end on cache
/// lines; the extra cells are not used.
Tile Wavefront::Impl::region_of(const std::array<int64_t, 3>& below, const std::array<int64_t, 3>& above,
                                const Tile& tile) const {
  Tile region = tile;
  for (size_t axis = splits_x ? 0 : 1; axis <= last; ++axis) {
    region[axis] = {tile[axis].from - below[axis], tile[axis].to + above[axis]};
    if (axis == 0 && below[0] + above[0] > 0) region[0] = {tile[0].from - strip_margin(), tile[0].to + strip_margin()};
    if (is_bounded(axis))
      region[axis] = {std::max<int64_t>(region[axis].from, 0), std::min(region[axis].to, layout.cells[axis])};
  }
  return region;
}

/// `first`: x of the first cell of the level's rows.
Access Wavefront::Impl::access_of(const WavefrontStream& stream, const Rings& rings, int64_t first) const {
  const auto index = static_cast<size_t>(stream.index);
  const int64_t slab_offset = stream.offset[last], row_offset = last == 2 ? stream.offset[1] : 0;
  const auto in_ring = [&](size_t ring, int64_t slots) {
    char* base = rings.base[ring] + (first + stream.offset[0] - rings.first[0]) * width;
    return Access{base,
                  slots - 1,
                  slot_size * width,
                  extent[0] * width,
                  slab_offset,
                  row_offset - (last == 2 ? rings.first[1] : 0)};
  };
  if (stream.kind == Kind::ring) return in_ring(index, plan.ring_slots[index]);
  if (stream.kind == Kind::input && rings.copies) {
    const auto copy = std::ranges::find_if(plan.copies, [&](const WavefrontCopy& one) {
      return one.program == stream.program && one.field == stream.index;
    });
    return in_ring(plan.ring_slots.size() + static_cast<size_t>(copy - plan.copies.begin()), copy->slots);
  }
  void* base =
      stream.kind == Kind::input ? executors[static_cast<size_t>(stream.program)]->bound(stream.index) : results[index];
  return {moved(base, first + stream.offset[0], width),
          -1,
          layout.stride[last] * width,
          layout.stride[1] * width,
          slab_offset,
          row_offset};
}

/// Sets the slab of each stream of a level.
void Wavefront::Impl::enter_slab(size_t number, Rings& rings, int64_t slab) const {
  const std::vector<Access>& accesses = rings.accesses[number];
  for (size_t s = 0; s < accesses.size(); ++s) {
    const Access& access = accesses[s];
    const int64_t place = slab + access.slab_offset;
    const int64_t at = access.mask >= 0      ? place & access.mask
                       : plan.periodic[last] ? wrapped(place, layout.cells[last])
                                             : place;
    rings.slabs[s] = access.base + at * access.slab_stride;
  }
}

/// Sets the pointers to a row of a plane; in 2-D slabs are rows.
void Wavefront::Impl::enter_row(size_t number, Rings& rings, int64_t y) const {
  const std::vector<Access>& accesses = rings.accesses[number];
  for (size_t s = 0; s < accesses.size(); ++s) {
    const Access& access = accesses[s];
    int64_t row = y + access.row_offset;
    if (access.mask < 0 && plan.periodic[1]) row = wrapped(row, layout.cells[1]);
    rings.pointers[s] = static_cast<char*>(rings.slabs[s]) + row * access.row_stride;
  }
  for (const size_t s :
       plan.levels[number].leading) {  // the hardware does not foresee the next row of a plane that is new to the cache
    const char* ahead = static_cast<const char*>(rings.pointers[s]) + accesses[s].row_stride;
    for (int64_t byte = 0; byte < rings.rows[number].count * width; byte += line_bytes)
      __builtin_prefetch(ahead + byte);
  }
}

void Wavefront::Impl::run_row(size_t number, Rings& rings, const Tile& tile, const Place& place) {
  const WavefrontLevel& level = plan.levels[number];
  if (last == 2) enter_row(number, rings, place[1]);
  dpde_row& row = rings.rows[number];
  row.y = plan.periodic[1] ? wrapped(place[1], layout.cells[1]) : place[1];
  row.z = plan.periodic[2] ? wrapped(place[2], layout.cells[2]) : place[2];
  if (level.sums.empty()) {
    level.row(&row);
  } else {
    call_with_sums(level, rings, row, tile, place);
  }
  keep_outputs(level, rings, tile, place);
}

/// Fills the halo of a row: at its ends, and on 3-D grids at walls along y.
void Wavefront::Impl::end_row(size_t number, Rings& rings, const Range& x, const Place& place) {
  const WavefrontLevel& level = plan.levels[number];
  for (size_t o = 0; o < level.outputs.size(); ++o) {
    if (level.outputs[o].fill && !(splits_x && !is_bounded(0))) fill_ends(number, o, rings, x, place);
  }
  if (last != 2 || !is_bounded(1)) return;
  const int64_t n = layout.cells[1], halo = layout.halo[1], y = place[1];
  if (y < halo) image_row(number, rings, x, 1, place, -1 - y);
  if (y >= n - halo) image_row(number, rings, x, 1, place, 2 * n - 1 - y);
}

void Wavefront::Impl::run_slab(size_t number, Rings& rings, const Tile& tile, int64_t slab) {
  const Tile& region = rings.regions[number];
  enter_slab(number, rings, slab);
  if (last == 1) {
    run_row(number, rings, tile, {0, slab, 0});
    end_row(number, rings, region[0], {0, slab, 0});
  } else {  // a row's halo is filled after the next row: reading what was just stored stalls until it is in the cache
    for (int64_t y = region[1].from; y <= region[1].to; ++y) {
      if (y < region[1].to) run_row(number, rings, tile, {0, y, slab});
      if (y > region[1].from) end_row(number, rings, region[0], {0, y - 1, slab});
    }
  }
  image_slab(number, rings, region, slab);
}

/// Copies a row of an input, continued beyond the ends of a periodic axis, for a strip.
void Wavefront::Impl::copy_slab(const WavefrontCopy& copy, const Rings& rings, const Tile& tile, int64_t slab) const {
  const Range y = is_bounded(1) ? Range{-layout.halo[1], layout.cells[1] + layout.halo[1]}
                                : Range{tile[1].from - copy.below[1], tile[1].to + copy.above[1]};
  if (slab < std::max(y.from, tile[1].from - copy.below[1]) || slab >= std::min(y.to, tile[1].to + copy.above[1]))
    return;
  const size_t ring = plan.ring_slots.size() + static_cast<size_t>(&copy - plan.copies.data());
  char* to = ring_row(ring, copy.slots, rings, {0, slab, 0});
  const int64_t row = is_bounded(1) ? slab : wrapped(slab, layout.cells[1]), n = layout.cells[0];
  const char* from =
      moved(executors[static_cast<size_t>(copy.program)]->bound(copy.field), row * layout.stride[1], width);
  const int64_t begin = tile[0].from - copy.below[0], end = tile[0].to + copy.above[0];
  const auto put = [&](int64_t first, int64_t last_one, int64_t shift) {
    if (first < last_one)
      std::memcpy(to + first * width, from + (first + shift) * width, static_cast<size_t>((last_one - first) * width));
  };
  put(begin, std::min<int64_t>(end, 0), n);
  put(std::max<int64_t>(begin, 0), std::min(end, n), 0);
  put(std::max(begin, n), end, -n);
}

/// Whether a strip extends beyond the ends of a periodic axis: it then reads inputs through copies.
bool Wavefront::Impl::needs_copies(const Tile& tile) const {
  if (!splits_x || is_bounded(0)) return false;
  const int64_t margin = strip_margin() + layout.halo[0];
  return std::ranges::any_of(plan.copies, [&](const WavefrontCopy& copy) {
    return tile[0].from < std::max(copy.below[0], margin) ||
           tile[0].to + std::max(copy.above[0], margin) > layout.cells[0];
  });
}

void Wavefront::Impl::begin_tile(Rings& rings, const Tile& tile) const {
  rings.first = {splits_x ? tile[0].from - before[0] : -before[0], tile[1].from - before[1], 0};
  rings.copies = needs_copies(tile);
  for (size_t number = 0; number < plan.levels.size(); ++number) {
    const WavefrontLevel& level = plan.levels[number];
    const Range x = (rings.regions[number] = region_of(level.below, level.above, tile))[0];
    for (size_t s = 0; s < level.streams.size(); ++s)
      rings.accesses[number][s] = access_of(level.streams[s], rings, x.from);
    dpde_row& row = rings.rows[number];
    row.streams = last == 2 ? rings.pointers.data() : rings.slabs.data();
    row.uniforms = uniforms[static_cast<size_t>(level.uniforms)].data();
    row.own = row.uniforms + level.own;
    row.count = x.count();
    row.first = x.from;
    row.layout = &layout;
  }
}

void Wavefront::Impl::run_tile(Rings& rings, const Tile& tile) {
  begin_tile(rings, tile);
  const std::vector<Tile>& regions = rings.regions;
  int64_t from = tile[last].from, to = tile[last].to;
  for (size_t number = 0; number < plan.levels.size(); ++number) {
    from = std::min(from, regions[number][last].from + plan.levels[number].lag);
    to = std::max(to, regions[number][last].to + plan.levels[number].lag);
  }
  for (const WavefrontCopy& copy : plan.copies) {
    if (rings.copies) from = std::min(from, tile[last].from - copy.below[last] - copy.ahead);  // lowest copied row
  }
  for (int64_t place = from; place < to; place += plan.rows_at_once) {
    for (size_t c = 0; rings.copies && c < plan.copies.size(); ++c) {
      for (int64_t k = 0; k < plan.rows_at_once; ++k)
        copy_slab(plan.copies[c], rings, tile, place + k + plan.copies[c].ahead);
    }
    for (size_t number = 0; number < plan.levels.size(); ++number) {
      const int64_t slab = place - plan.levels[number].lag;
      const Range& range = regions[number][last];
      for (int64_t at = std::max(slab, range.from); at < std::min(slab + plan.rows_at_once, range.to); ++at)
        run_slab(number, rings, tile, at);
    }
  }
}

std::optional<Wavefront> Wavefront::make(const Executor& executor, int steps, const Team& team) {
  std::optional<WavefrontPlan> plan = plan_wavefront(executor.program(), executor.layout(), steps);
  if (!plan) return std::nullopt;
  return Wavefront(std::make_unique<Impl>(std::array<const Executor*, 2>{&executor, nullptr}, std::move(*plan), team));
}

std::optional<Wavefront> Wavefront::make_reverse(const Executor& step, const Executor& adjoint,
                                                 const AdjointFields& fields, int steps, const Team& team) {
  std::optional<WavefrontPlan> plan =
      plan_reverse_wavefront(step.program(), adjoint.program(), fields, step.layout(), steps);
  if (!plan) return std::nullopt;
  return Wavefront(std::make_unique<Impl>(std::array<const Executor*, 2>{&step, &adjoint}, std::move(*plan), team));
}

Wavefront::Wavefront(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Wavefront::~Wavefront() = default;
Wavefront::Wavefront(Wavefront&&) noexcept = default;
Wavefront& Wavefront::operator=(Wavefront&&) noexcept = default;

int Wavefront::steps() const { return std::ranges::max(impl_->plan.passes, {}, &WavefrontPass::step).step + 1; }
const std::vector<WavefrontPass>& Wavefront::passes() const { return impl_->plan.passes; }

double Wavefront::work() const {
  double computed = 0, needed = 0;
  for (const Tile& tile : impl_->tiles) {
    for (const WavefrontLevel& level : impl_->plan.levels) {
      const Tile region = impl_->region_of(level.below, level.above, tile);
      computed += static_cast<double>(region[0].count() * region[1].count() * region[2].count());
      needed += static_cast<double>(tile[0].count() * tile[1].count() * tile[2].count());
    }
  }
  return computed / needed;
}

void Wavefront::set_uniforms(size_t pass, std::span<const double> uniforms) {
  const WavefrontPlan& plan = impl_->plan;
  const Executor& executor = *impl_->executors[static_cast<size_t>(plan.passes[pass].program)];
  const dpde_program& program = executor.program();
  for (size_t i = 0; i < plan.uniforms.size(); ++i) {
    if (plan.uniforms[i].pass != static_cast<int>(pass)) continue;
    std::ranges::copy(uniforms, impl_->uniforms[i].begin());
    if (plan.uniforms[i].counted.empty()) continue;
    std::vector<double>& params = impl_->params;
    params.assign(executor.params().begin(), executor.params().end());
    for (const auto& [counter, number] : plan.uniforms[i].counted)
      params[static_cast<size_t>(program.param_count) + counter] = number;
    program.compute_counted(params.data(), impl_->uniforms[i].data());
  }
}
void Wavefront::set_totals(std::span<double* const> totals) { impl_->totals.assign(totals.begin(), totals.end()); }
std::span<const double> Wavefront::sums(size_t pass) const { return impl_->sums[pass]; }

void Wavefront::run(std::span<void* const> results) {
  Impl& impl = *impl_;
  impl.results = results;
  const FloatScope without_subnormals;
  impl.team.run(static_cast<int64_t>(impl.tiles.size()), [&](int64_t tile, int thread) {
    impl.run_tile(impl.rings_of_threads[static_cast<size_t>(thread)], impl.tiles[static_cast<size_t>(tile)]);
  });
  impl.finish();
  impl.add_sums();
}

}  // namespace dpde
