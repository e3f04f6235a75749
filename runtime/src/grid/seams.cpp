// SPDX-License-Identifier: Apache-2.0
#include "grid/seams.h"

#include <algorithm>
#include <span>

#include "dpde/runtime/layout.h"

namespace dpde {
namespace {

std::span<const dpde_stream> streams_of(const dpde_kernel& kernel) {
  return {kernel.streams, static_cast<std::size_t>(kernel.stream_count)};
}
std::span<const dpde_grid> grids_of(const dpde_kernel& kernel) {
  return {kernel.grids, static_cast<std::size_t>(kernel.grid_count)};
}

}  // namespace

Seams::Seams(const dpde_program& program, const dpde_layout& layout, Communicator& ranks)
    : program_(&program),
      layout_(&layout),
      exchange_(layout, ranks),
      is_current_(static_cast<std::size_t>(program.field_count), 0) {
  for (int i = 0; i < program.prepare_count; ++i) note(program.prepare[i].field, true);
  std::size_t grids = 0;
  for (int k = 0; k < program.kernel_count; ++k) grids = std::max(grids, grids_of(program.kernels[k]).size());
  if (grids > 0) whole_.emplace(layout, ranks, grids);
}

void Seams::note(int field, bool is_current) {
  if (field >= 0) is_current_[static_cast<std::size_t>(field)] = is_current ? 1 : 0;
}

void Seams::begin_block() { std::ranges::fill(is_current_, 0); }

bool Seams::crosses(const dpde_stream& stream) const {
  bool crosses = false;
  for (std::size_t a = 0; a < 3; ++a) crosses = crosses || (is_divided(*layout_, a) && stream.offset[a] != 0);
  return crosses;
}

std::vector<SeamWork> Seams::before(const dpde_operation& operation) {
  std::vector<SeamWork> work;
  if (operation.kind != DPDE_SWEEP) return work;
  for (const dpde_stream& stream : streams_of(kernel_of(operation))) {
    if (is_current_[static_cast<std::size_t>(stream.field)] != 0 || !crosses(stream)) continue;
    work.push_back({SeamWork::Kind::exchange, stream.field});
    note(stream.field, true);
  }
  std::size_t number = 0;
  for (const dpde_grid& grid : grids_of(kernel_of(operation)))
    work.push_back({grid.is_written != 0 ? SeamWork::Kind::clear : SeamWork::Kind::gather, grid.field, number++});
  return work;
}

/// A written field's halo at interfaces is outdated, a filled field's is up to date.
std::vector<SeamWork> Seams::after(const dpde_operation& operation) {
  std::vector<SeamWork> work;
  switch (operation.kind) {
    case DPDE_FILL: note(operation.fill.field, true); break;
    case DPDE_FOLD:
      note(operation.fill.field, false);
      for (const dpde_boundary& sides : operation.fill.axes) {
        if (sides.low.rule == nullptr) continue;
        note(sides.low.field, false);
        note(sides.high.field, false);
      }
      break;
    case DPDE_REDUCE: note(operation.reduce.result, false); break;
    case DPDE_SWEEP: {
      for (const dpde_stream& stream : streams_of(kernel_of(operation))) {
        if (stream.is_written != 0) note(stream.field, false);
      }
      std::size_t number = 0;
      for (const dpde_grid& grid : grids_of(kernel_of(operation))) {
        if (grid.is_written != 0) {
          work.push_back({SeamWork::Kind::add, grid.field, number});
          note(grid.field, false);
        }
        ++number;
      }
      for (int f = 0; f < operation.then_count; ++f) note(operation.then[f].field, true);
      break;
    }
    default: begin_block();
  }
  return work;
}

void Seams::run(const SeamWork& work, void* const* fields) {
  switch (work.kind) {
    case SeamWork::Kind::exchange: exchange_.run(fields[work.field]); break;
    case SeamWork::Kind::gather: whole_->gather(fields[work.field], work.whole); break;
    case SeamWork::Kind::clear: whole_->clear(work.whole); break;
    case SeamWork::Kind::add: whole_->add(work.whole, fields[work.field]); break;
  }
}

}  // namespace dpde
