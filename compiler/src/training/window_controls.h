// SPDX-License-Identifier: Apache-2.0
// A task whose data are trajectories and whose unknowns are controls: each window has its own, found for it alone by
// the task's optimiser. The windows of a run stand end to end; each begins with a frame of the data.
#pragma once

#include "training/data/window_batches.h"

namespace dpde::training {

/// Whether this is such a task.
bool seeks_controls(const model::Problem& problem);

struct FoundControls {
  Window window;
  std::vector<double> losses;  // entry k: before iteration k; the last one with the controls found
  double norm = 0;             // of the controls
  std::string why;             // the search came to nothing: what is not finite, where; "": it did not
  std::vector<std::vector<double>>
      states;  // of each state of the scene, at the frames behind the first one after the other
};

class WindowControls {
 public:
  /// iterations > 0: in place of the task's.
  WindowControls(const TrainingScene& scene, int iterations, const BatchOptions& options);

  /// So many of each run as it has frames for.
  std::vector<Window> windows() const;
  /// Frames at the end of each run that fill no window.
  int frames_left_over() const;
  /// Of everything that what is found depends on.
  std::uint64_t key();
  std::vector<std::string> states() const;
  /// The given windows, several at once; `take` gets them in any order, one at a time, and may say that it is enough.
  /// False when not all were searched. @throws Error
  bool find(std::span<const Window> windows, const std::function<bool(FoundControls)>& take);

 private:
  FoundControls find_one(Simulation& simulation, const Window& window) const;
  void run(Simulation& simulation, FoundControls& found) const;
  int frames() const { return scene_.steps() / scene_.trajectories.every; }

  const TrainingScene& scene_;
  int iterations_;
  BatchOptions options_;
  WindowBatches batches_;
};

}  // namespace dpde::training
