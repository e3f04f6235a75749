// SPDX-License-Identifier: Apache-2.0
// Repeated trainings: trial k (from 0) adds k to the seeds of its sample order, its noise, and initial weights that are
// not from a file. This separates the effect of chance.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "training/trainer.h"

namespace dpde::training {

struct Trial {
  std::unique_ptr<Trainer> trainer;
  TrainingEnd end = TrainingEnd::stopped;
  double seconds = 0;      // since it was begun or resumed
  double cpu_seconds = 0;  // of all threads since it was begun; NaN if its checkpoint lacks it
};

class Trials {
 public:
  /// See Trainer::open.
  static std::unique_ptr<Trials> open(const TrainingScene& scene, int epochs, const BatchOptions& options,
                                      DiagnosticSink& sink);

  /// Called after every update of the present trial; returning false stops.
  using Watch = std::function<bool(const Trials&)>;
  void run(const Watch& watch);

  /// Number of trials that the task asks for.
  int count() const { return scene_.training().trials; }
  /// Trials begun so far.
  const std::vector<Trial>& all() const { return trials_; }
  /// The trial that ran or was resumed last.
  std::size_t running() const { return running_; }
  const Trainer& present() const { return *trials_[running_].trainer; }
  std::uint64_t seed_of(std::size_t trial) const { return scene_.training().seed + options_.seed + trial; }
  /// Trial with the lowest validation loss, else the lowest training loss; tests are never used. The first one if none
  /// has finished an epoch.
  std::size_t best() const;
  /// Updates of all trials so far, and in total if no epoch is skipped.
  std::int64_t made() const;
  std::int64_t updates() const { return count() * present().updates(); }

  /// The checkpoint as content of a file. It can be restored with another number of trials: existing ones stay as they
  /// are, and surplus ones stay in the checkpoint.
  std::string save() const;
  bool restore(std::string_view bytes, const std::string& file, DiagnosticSink& sink);

 private:
  Trials(const TrainingScene& scene, int epochs, const BatchOptions& options)
      : scene_(scene), epochs_(epochs), options_(options) {}
  bool begin(DiagnosticSink& sink);

  const TrainingScene& scene_;
  int epochs_;
  BatchOptions options_;
  std::vector<Trial> trials_;
  struct Kept {
    double cpu_seconds = 0;
    std::string checkpoint;
  };
  std::vector<Kept> kept_;  // surplus trials
  std::size_t running_ = 0;
};

struct FoundTrial {
  FoundValues values;
  double cpu_seconds = 0;  // see Trial
};
/// Trials in a checkpoint. Reports bad-array-file and returns none if it is damaged.
std::vector<FoundTrial> found_trials(std::string_view bytes, const std::string& file, DiagnosticSink& sink);

}  // namespace dpde::training
