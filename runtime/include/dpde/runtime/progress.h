// SPDX-License-Identifier: Apache-2.0
// What long calls tell whoever waits for them, who may stop them, and why an optimiser stopped.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace dpde {

/// Of a run, every so many steps.
struct Progress {
  int step, steps;  // of this call
  double time;
};
/// False stops the run.
using ProgressCallback = std::function<bool(const Progress&)>;

/// Of a loss or a gradient: `done` of `total` steps, those forward, those computed again from stored states, and those
/// back.
struct GradientProgress {
  std::int64_t done, total;  // of a run until steady the most it may take, which grows with products of its solve
  double time;               // of the state it is at: it rises, and falls on the way back
  bool is_back = false;      // that state's adjoint has just been found
};
/// False stops it.
using GradientCallback = std::function<bool(const GradientProgress&)>;

/// Of an optimiser: before update `iteration` (0, 1, ...), and once more after the last one.
struct OptimiserProgress {
  int iteration;
  double loss;
  double gradient_norm;  // of the components that are free to move
};
/// False stops the optimiser.
using OptimiserCallback = std::function<bool(const OptimiserProgress&)>;

enum class StopReason {
  iterations,     // all wanted updates were made
  gradient_zero,  // the gradient's norm is below the tolerance
  no_progress,    // L-BFGS, Newton: no step along the direction lowers the loss any more, or what changes is rounding
  not_finite,     // the loss or the gradient is not a finite number
  observer,       // the observer said so
};
std::string describe(StopReason reason);

}  // namespace dpde
