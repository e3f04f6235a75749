// SPDX-License-Identifier: Apache-2.0
// Progress reports of long calls, which the receiver can stop, and the reasons why an optimiser stopped.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace dpde {

/// Of a run, at intervals of steps.
struct Progress {
  int step, steps;  // of this call
  double time;
};
/// Return false to stop the run.
using ProgressCallback = std::function<bool(const Progress&)>;

/// Of a loss or a gradient: `done` of `total` steps, counting forward steps, recomputed steps and adjoint steps.
struct GradientProgress {
  std::int64_t done, total;  // total: for a run until steady an upper bound, growing with the products of its solve
  double time;               // time of the current state; falls on the way back
  bool is_back = false;      // the adjoint of that state has just been computed
};
/// Return false to stop.
using GradientCallback = std::function<bool(const GradientProgress&)>;

/// Of an optimiser: before update `iteration` (0, 1, ...), and once more after the last one.
struct OptimiserProgress {
  int iteration;
  double loss;
  double gradient_norm;  // of the components that are free to move
};
/// Return false to stop the optimiser.
using OptimiserCallback = std::function<bool(const OptimiserProgress&)>;

/// Why an optimiser ended.
enum class StopReason {
  iterations,     // all requested updates were made
  gradient_zero,  // the gradient's norm is below the tolerance
  no_progress,    // L-BFGS, Newton: no step along the direction lowers the loss, or changes are rounding
  not_finite,     // the loss or the gradient is not a finite number
  observer,       // the observer stopped it
};
/// The same in words.
std::string describe(StopReason reason);

}  // namespace dpde
