// SPDX-License-Identifier: Apache-2.0
// Implementation of Wavefront: tiles, rings, and positions of rows. Inside the runtime only.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "dpde/runtime/buffer.h"
#include "grid/fill.h"
#include "grid/real.h"
#include "wavefront/wavefront.h"

namespace dpde::wavefront {

/// Ranges and places are passed by reference: by value, g++ writes their halves to the stack and reads them back as one
/// vector, which waits until the row stored before is in the cache (a fifth of the time of 3-D blocks).
struct Range {
  int64_t from = 0, to = 1;
  int64_t count() const { return to - from; }
};
/// The result cells of one thread in one go; the wavefront moves along the last axis.
using Tile = std::array<Range, 3>;
using Place = std::array<int64_t, 3>;  // of a row; x is ignored

inline bool contains(const Range& range, int64_t place) { return place >= range.from && place < range.to; }

/// Wraps a position at most one period away to 0 .. cells - 1.
inline int64_t wrapped(int64_t place, int64_t cells) {
  return place < 0 ? place + cells : place >= cells ? place - cells : place;
}

/// Location of the rows of one stream in the current tile.
struct Access {
  char* base;    // first cell of the first row (of ring slot 0, or of the field) at the stream's offset along x
  int64_t mask;  // of ring slots; -1: no ring
  int64_t slab_stride, row_stride;  // bytes
  int64_t slab_offset, row_offset;  // the stream's; row_offset counts from the first row of a slot
};

/// Rings and pointers of one thread.
struct Rings {
  Buffer memory;
  std::vector<char*> base;                    // of each ring, then of each copy: first element of slot 0
  std::vector<void*> pointers;                // of the streams of a level, at the row
  std::vector<void*> pieces;                  // at a piece of the row
  std::vector<double> unused_sums;            // sums of pieces beyond the tile
  std::vector<void*> slabs;                   // pointers at the slab
  std::vector<dpde_row> rows;                 // arguments of a level's calls; y, z are those of the last call
  std::vector<std::vector<Access>> accesses;  // of each level's streams
  std::vector<Tile> regions;                  // of each level
  std::array<int64_t, 3> first{};             // position of the first element of a slot
  bool copies = false;                        // the tile reads inputs through copies
};

}  // namespace dpde::wavefront

namespace dpde {

struct Wavefront::Impl {
  using Kind = WavefrontStream::Kind;
  using Range = wavefront::Range;
  using Tile = wavefront::Tile;
  using Place = wavefront::Place;
  using Rings = wavefront::Rings;
  using Access = wavefront::Access;

  Impl(std::array<const Executor*, 2> from, WavefrontPlan made, const Team& threads);
  void make_sums();
  void make_tiles(int threads);
  void allocate(Rings& rings) const;
  bool needs_copies(const Tile& tile) const;
  void begin_tile(Rings& rings, const Tile& tile) const;
  void run_tile(Rings& rings, const Tile& tile);
  void run_slab(size_t number, Rings& rings, const Tile& tile, int64_t slab);
  Access access_of(const WavefrontStream& stream, const Rings& rings, int64_t first) const;
  void enter_slab(size_t number, Rings& rings, int64_t slab) const;
  void enter_row(size_t number, Rings& rings, int64_t y) const;
  void run_row(size_t number, Rings& rings, const Tile& tile, const Place& place);
  void end_row(size_t number, Rings& rings, const Range& x, const Place& place);
  void call_with_sums(const WavefrontLevel& level, Rings& rings, dpde_row row, const Tile& tile, const Place& place);
  void keep_outputs(const WavefrontLevel& level, const Rings& rings, const Tile& tile, const Place& place) const;
  void add_sums();
  void fill_ends(size_t number, size_t output, const Rings& rings, const Range& x, const Place& place) const;
  void copy_slab(const WavefrontCopy& copy, const Rings& rings, const Tile& tile, int64_t slab) const;
  void image_slab(size_t number, Rings& rings, Tile region, int64_t slab) const;
  void image_row(size_t number, Rings& rings, const Range& x, size_t axis, const Place& from, int64_t to) const;
  char* row_of(const WavefrontStream& output, const Rings& rings, const Place& place) const;
  char* ring_row(size_t ring, int64_t slots, const Rings& rings, const Place& place) const;
  Tile region_of(const std::array<int64_t, 3>& below, const std::array<int64_t, 3>& above, const Tile& tile) const;
  void finish() const;
  int64_t slots() const;
  int64_t round_up(int64_t count) const { return (count + line - 1) / line * line; }
  int64_t strip_margin() const { return round_up(plan.reach(0)); }
  bool is_bounded(size_t axis) const { return !plan.periodic[axis]; }

  Team team;
  std::array<const Executor*, 2> executors;  // of the step and its adjoint
  dpde_layout layout;
  WavefrontPlan plan;
  size_t last;                                // axis
  int64_t width;                              // bytes of a value
  int64_t line;                               // values of a cache line
  std::vector<std::vector<HaloFill>> fills;   // of each level's outputs
  std::vector<std::vector<double>> uniforms;  // in the order of the plan
  std::vector<double> params;                 // of a program, with the values of its counters
  std::vector<std::vector<double>> sums;      // of each pass
  std::vector<int64_t> first_row_sum;         // of each level: begin of its sums in row_sums
  std::vector<double> row_sums;               // by level, strip, plane, row and sum
  std::vector<double*> totals;
  std::vector<Tile> tiles;
  bool splits_x = false;
  int64_t strips = 1;                                // along x
  std::array<int64_t, 3> before{}, extent{1, 1, 1};  // of a slot: cells before the tile's first one, and total
  int64_t slot_size = 0;
  std::vector<Rings> rings_of_threads;
  std::span<void* const> results;
};

}  // namespace dpde
