// SPDX-License-Identifier: Apache-2.0
// Real Fourier transforms of all lines of a grid along one axis, in blocks of lines that stay in the cache, by a team.
// Blocks do not depend on the number of threads.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "dpde/runtime/team.h"
#include "solve/operator/vector_parts.h"
#include "transform/fft.h"

namespace dpde {

/// The lines along an axis, x fastest; the modes of a line are contiguous. Lines have a constant distance, except for
/// the middle one of three axes.
inline RealLines lines_along(std::size_t axis, const std::array<std::int64_t, 3>& cells) {
  std::int64_t before = 1, behind = 1;
  for (std::size_t other = 0; other < 3; ++other) {
    if (other != axis) (other < axis ? before : behind) *= cells[other];
  }
  const std::int64_t n = cells[axis];
  return {n, before * behind, before, before == 1 ? n : 1, 1, n / 2 + 1};
}

class FftBlocks {
 public:
  static constexpr std::int64_t lines_of_block = 8;

  /// Small grids are transformed by one thread.
  FftBlocks(const RealLines& lines, const Team& team) : lines_(lines), block_(std::min(lines_of_block, lines.lines)) {
    if (lines.length * lines.lines >= least_cells_of_team) team_ = team;
    const auto some = [&](std::int64_t count) {
      RealLines made = lines;
      made.lines = count;
      return RealFft(made);
    };
    for (int i = 0; i < team_.threads(); ++i) {
      OfThread& own = of_threads_.emplace_back(OfThread{some(block_), {}});
      if (lines.lines % block_ != 0) own.fewer.emplace(some(lines.lines % block_));
    }
  }

  const RealLines& lines() const { return lines_; }
  const Team& team() const { return team_; }
  std::int64_t block() const { return block_; }

  /// Calls f(transform, first line, number of lines, thread) for each block.
  template <class F>
  void for_each(const F& f) {
    team_.run((lines_.lines + block_ - 1) / block_, [&](std::int64_t number, int thread) {
      OfThread& own = of_threads_[static_cast<std::size_t>(thread)];
      const std::int64_t first = number * block_, count = std::min(block_, lines_.lines - first);
      f(count == block_ ? own.block : *own.fewer, first, count, thread);
    });
  }

 private:
  struct OfThread {
    RealFft block;
    std::optional<RealFft> fewer;  // for the lines after the last whole block
  };

  Team team_;
  RealLines lines_;
  std::int64_t block_;
  std::vector<OfThread> of_threads_;
};

}  // namespace dpde
