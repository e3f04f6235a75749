// SPDX-License-Identifier: Apache-2.0
// What networks and linear solves computed in the steps and losses of a gradient is kept for their adjoints, as far as
// memory goes: of the last runs, which the way back needs first. Steps that are made again fill tapes that are free by
// then. Inside the runtime only.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "dpde/runtime/executor.h"
#include "dpde/runtime/tapes.h"
#include "run/value_ids.h"

namespace dpde {

/// A program whose adjoint would compute again what it computes, and how often the gradient runs both.
struct ProgramPair {
  Executor& program;
  Executor& adjoint;
  int64_t runs;
};

class TapeStore {
 public:
  /// States come first, since steps cost more than networks and solves: `left` bytes of the budget are there. All pairs
  /// get the same share of their runs, at most `most_share`.
  void plan(const ResolvedSetup& setup, std::span<const ProgramPair> pairs, int64_t left, double most_share,
            bool is_plan);
  int64_t bytes() const { return bytes_; }
  /// Begins to record, or ends that.
  void record(bool on);
  /// Runs since it began that adjoints did not make again.
  int64_t used() const { return used_; }

 private:
  std::vector<std::shared_ptr<Tapes>> tapes_;
  int64_t bytes_ = 0, used_ = 0;
};

/// While it lives tapes record; not any more where a step has no solution.
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
