// SPDX-License-Identifier: Apache-2.0
// What forward runs of a network computed on the way, one tape a run, for the adjoints of the same runs. A tape is
// found by its inputs, compared to the last bit: whoever finds one has what computing it again would give, wherever the
// run was made. All memory is there from the beginning; where it is full the tape that was taken first is given up.
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

  /// Writers write only between record(true), which begins to count anew, and record(false).
  void record(bool on) {
    records_ = on;
    if (on) found_ = missed_ = 0;
  }
  bool is_recording() const { return records_ && !is_useless_; }

  char* take();
  /// The last one that `matches(tape)`; null: none among those taken last.
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
  /// Nobody will look for it any more.
  void release(char* tape);
  /// All of them: the weights have changed.
  void clear();

  int64_t bytes() const { return bytes_; }
  /// How many were there since record(true).
  int64_t found() const { return found_; }

 private:
  static constexpr int64_t most_looked_at = 64, patience = 64;
  // Where many were looked for and none has ever been there readers compute their inputs another way than writers: no
  // use in keeping them.
  bool was_useful_ = false, is_useless_ = false;
  int64_t bytes_, found_ = 0, missed_ = 0;
  bool records_ = false;
  Buffer memory_;
  std::vector<char*> free_, taken_;  // taken_: the first one first
};

}  // namespace dpde
