// SPDX-License-Identifier: Apache-2.0
// The order in which CycleLevel processes its rows.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "solve/multigrid/cycle_level.h"

namespace dpde {

template <class Real>
template <class F>
void CycleLevel<Real>::for_each_row(const F& f) const {
  std::int64_t number = 0;
  for (std::int64_t z = 0; z < cells_[2]; ++z) {
    for (std::int64_t y = 0; y < cells_[1]; ++y) f(Row{number++, y, z});
  }
}

template <class Real>
template <class F>
void CycleLevel<Real>::share_rows(const F& f) const {
  const std::int64_t rows = count_of_rows(), parts = std::min<std::int64_t>(rows, 4 * team_.threads());
  team_.run(parts, [&](std::int64_t part, int thread) {
    Row row = row_at(rows * part / parts);
    for (const std::int64_t end = rows * (part + 1) / parts; row.number < end; go_on(row)) f(row, thread);
  });
}

/// Each slab of rows runs the stages as far as no rows of its neighbours are needed; then the rows at the interfaces
/// are done, stage by stage. On a periodic outer axis there is an interface before the first row.
template <class Real>
template <class... Stages>
void CycleLevel<Real>::in_turns(const Stages&... stages) const {
  constexpr std::int64_t count = sizeof...(Stages);
  const std::int64_t outer = axes_ == 0 ? 1 : cells_[axes_];
  const std::int64_t away = count_of_rows() / outer;  // distance of neighbouring rows along the last axis
  const std::int64_t slabs = std::clamp<std::int64_t>(outer / (2 * count + 2), 1, team_.threads());
  const auto is_seam = [&](std::int64_t slab) { return is_outer_ring_ || (slab != 0 && slab != slabs); };
  const auto begin_of = [&](std::int64_t slab) { return outer * slab / slabs * away; };
  // on a periodic axis with fewer planes than stages all rows of a stage may be first rows
  const auto first_of = [&](std::int64_t slab, std::int64_t stage) {
    return std::min(begin_of(slab) + (is_seam(slab) ? stage * away : 0), begin_of(slab + 1));
  };
  const auto end_of = [&](std::int64_t slab, std::int64_t stage) {
    return std::max(begin_of(slab + 1) - (is_seam(slab + 1) ? stage * away : 0), first_of(slab, stage));
  };
  team_.run(slabs, [&](std::int64_t slab, int thread) {
    struct Turn {
      Row next;
      std::int64_t end, behind;  // rows of delay
    };
    std::array<Turn, count> turns;
    for (std::int64_t stage = 0; stage < count; ++stage)
      turns[static_cast<std::size_t>(stage)] = {row_at(first_of(slab, stage)), end_of(slab, stage), stage * away};
    for (std::int64_t i = begin_of(slab), end = begin_of(slab + 1) + (count - 1) * away; i < end; ++i) {
      Turn* turn = turns.data();
      const auto one = [&](const auto& f) {
        if (turn->next.number == i - turn->behind && turn->next.number < turn->end) {
          f(turn->next, thread);
          go_on(turn->next);
        }
        ++turn;
      };
      (one(stages), ...);
    }
  });
  if (slabs == 1 && !is_outer_ring_) return;
  team_.run(slabs, [&](std::int64_t slab, int thread) {
    if (!is_seam(slab)) return;
    const std::int64_t before = slab == 0 ? slabs - 1 : slab - 1;
    std::int64_t stage = 0;
    const auto one = [&](const auto& f) {
      const std::int64_t last = begin_of(before + 1), first = first_of(slab, stage);
      for (Row row = row_at(end_of(before, stage)); row.number < last; go_on(row)) f(row, thread);
      for (Row row = row_at(begin_of(slab)); row.number < first; go_on(row)) f(row, thread);
      ++stage;
    };
    (one(stages), ...);
  });
}

}  // namespace dpde
