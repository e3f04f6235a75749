// SPDX-License-Identifier: Apache-2.0
// Intermediate results of forward runs of a network, one tape a run, for the adjoints of the same runs. A tape is found
// by its inputs, compared bit by bit: it holds exactly what recomputing would give, wherever the run was made. All
// memory is allocated in advance; if it is full the oldest tape is dropped.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "dpde/runtime/buffer.h"

namespace dpde {

class Tapes {
 public:
  /// @throws Error(machine) when there is no memory.
  Tapes(int64_t tape_bytes, int64_t count);

  /// Tapes are written only between record(true), which resets the counters, and record(false).
  void record(bool on) {
    records_ = on;
    if (on) found_ = missed_ = 0;
  }
  bool is_recording() const { return records_ && !is_useless_; }

  char* take();
  /// The latest tape for which `matches(tape)`; null: none among the last `most_looked_at` ones.
  template <class Matches>
  char* find(const Matches& matches) {
    const auto end =
        taken_.rend() - taken_.rbegin() > most_looked_at ? taken_.rbegin() + most_looked_at : taken_.rend();
    const auto found = std::find_if(taken_.rbegin(), end, matches);
    ++(found == end ? missed_ : found_);
    was_useful_ = was_useful_ || found != end;
    is_useless_ = !was_useful_ && missed_ >= patience;
    return found == end ? nullptr : *found;
  }
  /// Frees a tape that is no longer needed.
  void release(char* tape);
  /// Frees all tapes: the weights have changed.
  void clear();

  int64_t bytes() const { return bytes_; }
  /// Number of successful searches since record(true).
  int64_t found() const { return found_; }

 private:
  static constexpr int64_t most_looked_at = 64, patience = 64;
  // If many searches were made and all failed, readers compute their inputs in another way than writers: storing tapes
  // is then useless.
  bool was_useful_ = false, is_useless_ = false;
  int64_t bytes_, found_ = 0, missed_ = 0;
  bool records_ = false;
  Buffer memory_;
  std::vector<char*> free_, taken_;  // taken_: oldest first
};

}  // namespace dpde
