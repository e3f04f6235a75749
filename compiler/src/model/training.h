// SPDX-License-Identifier: Apache-2.0
// How a task learns from trajectories: in updates by the gradients of mini-batches of windows, a window being the
// frames of a run from one on.
#pragma once

#include <cstdint>
#include <vector>

namespace dpde::model {

struct RateSchedule {
  enum class Kind { constant, halve, cosine } kind = Kind::constant;
  int every = 1;  // halve: so many updates
};

struct Training {
  int batch = 1, epochs = 10;
  int trials = 1;  // repetitions, the k-th one (from 0) with k added to the seeds of windows, noise and first weights
  std::uint64_t seed = 0;   // of the order of the windows and of the noise
  std::vector<int> unroll;  // lengths of windows, in steps, each for an equal share of the epochs; empty: the loss's
  int cut = 0;              // > 0: gradients go through so many steps at most
  double noise = 0;         // added to the states a window begins with, in deviations of the field over the data
  double clip = 0;          // > 0: longest gradient
  double validate = 0;      // share of the runs that is kept for validation; of the windows where there is one run
  int patience = 0;         // > 0: stop when the best loss is so many epochs old
  RateSchedule schedule;
};

}  // namespace dpde::model
