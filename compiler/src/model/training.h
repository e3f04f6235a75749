// SPDX-License-Identifier: Apache-2.0
// Training on trajectories by gradients of mini-batches of samples. A sample consists of consecutive frames of a run.
#pragma once

#include <cstdint>
#include <vector>

namespace dpde::model {

struct RateSchedule {
  enum class Kind { constant, halve, cosine } kind = Kind::constant;
  int every = 1;  // halve: number of updates between two halvings
};

struct Training {
  int batch = 1, epochs = 10;
  int trials = 1;  // repetitions; repetition k (from 0) adds k to the seeds of sample order, noise and initial weights
  std::uint64_t seed = 0;   // for the order of samples and the noise
  std::vector<int> unroll;  // sample lengths in steps, each for an equal share of the epochs; empty: the loss's
  int cut = 0;              // > 0: gradients are truncated after this many steps
  double noise = 0;         // added to the initial states of samples, in standard deviations of the field over the data
  double clip = 0;          // > 0: maximum norm of a gradient
  double validate = 0;      // fraction of the runs kept for validation; with a single run, of the samples
  int patience = 0;         // > 0: stop if the best loss is this many epochs old
  RateSchedule schedule;
};

}  // namespace dpde::model
