// SPDX-License-Identifier: Apache-2.0
// Stores intermediate results of networks and linear solves in the steps and losses of a gradient for their adjoints,
// as far as memory allows: of the last runs, which the adjoints need first. Recomputed steps reuse tapes that are free
// by then. Inside the runtime only.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "dpde/runtime/executor.h"
#include "dpde/runtime/tapes.h"
#include "run/value_ids.h"

namespace dpde {

/// A program whose adjoint would repeat its computations, and how often the gradient runs both.
struct ProgramPair {
  Executor& program;
  Executor& adjoint;
  int64_t runs;
};

class TapeStore {
 public:
  /// States have priority, since steps cost more than networks and solves: `left` bytes of the budget remain. All pairs
  /// get the same share of their runs, at most `most_share`.
  void plan(const ResolvedSetup& setup, std::span<const ProgramPair> pairs, int64_t left, double most_share,
            bool is_plan);
  int64_t bytes() const { return bytes_; }
  /// Starts or stops recording.
  void record(bool on);
  /// Number of runs since the start of recording that adjoints did not repeat.
  int64_t used() const { return used_; }

 private:
  std::vector<std::shared_ptr<Tapes>> tapes_;
  int64_t bytes_ = 0, used_ = 0;
};

/// Records tapes during its lifetime; also ended by the exception of a failed solve.
class Recording {
 public:
  explicit Recording(TapeStore& tapes) : tapes_(tapes) { tapes_.record(true); }
  ~Recording() { tapes_.record(false); }
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

 private:
  TapeStore& tapes_;
};

}  // namespace dpde
