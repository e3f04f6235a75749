// SPDX-License-Identifier: Apache-2.0
// A training repeated: the k-th trial (from 0) has k added to the seeds of its windows and noise, and of the weights
// that networks begin with where no file gives them. What one training finds by luck, several show.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "training/trainer.h"

namespace dpde::training {

struct Trial {
  std::unique_ptr<Trainer> trainer;
  TrainingEnd end = TrainingEnd::stopped;
  double seconds = 0;      // since it was begun or taken up again
  double cpu_seconds = 0;  // of all threads, since it was begun; not a number when a checkpoint does not tell
};

class Trials {
 public:
  /// As Trainer::open.
  static std::unique_ptr<Trials> open(const TrainingScene& scene, int epochs, const BatchOptions& options,
                                      DiagnosticSink& sink);

  /// Called after every update of the present trial; false stops.
  using Watch = std::function<bool(const Trials&)>;
  void run(const Watch& watch);

  /// As the task says.
  int count() const { return scene_.training().trials; }
  /// Those that were begun.
  const std::vector<Trial>& all() const { return trials_; }
  /// The one that runs, ran or was taken up again last.
  std::size_t running() const { return running_; }
  const Trainer& present() const { return *trials_[running_].trainer; }
  std::uint64_t seed_of(std::size_t trial) const { return scene_.training().seed + options_.seed + trial; }
  /// By validation, else by the loss of training; never by a test. The first one where none has come to the end of an
  /// epoch.
  std::size_t best() const;
  /// Updates of all trials so far, and when no epoch is left out.
  std::int64_t made() const;
  std::int64_t updates() const { return count() * present().updates(); }

  /// The checkpoint as bytes of a file. Taken up with more or fewer trials, those that there are stay as they are;
  /// trials beyond those that are wanted stay in the checkpoint.
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
  std::vector<Kept> kept_;  // of trials that are not wanted now
  std::size_t running_ = 0;
};

struct FoundTrial {
  FoundValues values;
  double cpu_seconds = 0;  // see Trial
};
/// Of the trials in a checkpoint. Reports bad-array-file; empty then.
std::vector<FoundTrial> found_trials(std::string_view bytes, const std::string& file, DiagnosticSink& sink);

}  // namespace dpde::training
