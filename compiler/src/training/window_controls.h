// SPDX-License-Identifier: Apache-2.0
// Tasks whose data are trajectories and whose unknowns are controls: the task's optimiser finds separate controls for
// each sample. The samples of a run are adjacent; each begins with a frame of the data.
#pragma once

#include "training/data/window_batches.h"

namespace dpde::training {

/// Whether it is such a task.
bool seeks_controls(const model::Problem& problem);

struct FoundControls {
  Window window;
  std::vector<double> losses;               // entry k: before iteration k; the last one with the final controls
  double norm = 0;                          // of the controls
  std::string why;                          // why the search failed: what is not finite, and where; "": success
  std::vector<std::vector<double>> states;  // for each state of the scene, at the frames after the first
};

class WindowControls {
 public:
  /// iterations > 0: overrides the task's.
  WindowControls(const TrainingScene& scene, int iterations, const BatchOptions& options);

  /// As many samples of each run as its frames allow.
  std::vector<Window> windows() const;
  /// Frames at the end of each run that form no complete sample.
  int frames_left_over() const;
  /// Hash of everything that the result depends on.
  std::uint64_t key();
  std::vector<std::string> states() const;
  /// Searches for the given samples in parallel; `take` gets results in any order, one at a time, and may end the
  /// search. Returns false if not all samples were searched. @throws Error
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
