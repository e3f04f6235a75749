// SPDX-License-Identifier: Apache-2.0
// Learns the unknowns of a task from trajectories: epochs over all samples in random order, with one update for each
// batch; or iterations of L-BFGS or Newton's method, where an epoch is one update by all samples. Deterministic: a
// training that is stopped and resumed gives the same numbers to the last bit, for any number of threads.
#pragma once

#include <filesystem>
#include <functional>
#include <limits>

#include "dpde/runtime/optimise.h"
#include "dpde/runtime/update_rule.h"
#include "driver/report/restart_file.h"
#include "training/data/window_batches.h"

namespace dpde::training {

/// One pass over all samples.
struct Epoch {
  int unroll = 1;            // steps of its samples
  double loss = 0;           // mean over batches, each at its own values; for one batch of all, at those after it
  double validation = 0;     // at the values after it; NaN without validation
  double rate = 0;           // learning rate of its last update; 0: none
  std::int64_t updates = 0;  // total at its end
};

/// Content of a checkpoint, from which a training continues as if it had not stopped.
struct TrainingState {
  UpdateState updates;
  LbfgsState lbfgs;                   // of L-BFGS once it has begun; for Newton's method without pairs
  double first_norm = 0, radius = 0;  // for Newton's method (see NewtonCgState)
  Eigen::VectorXd scale;              // of each unknown, for L-BFGS; empty: none
  int epoch = 0, batch = 0;           // the next ones
  double epoch_loss = 0;              // sum over the finished batches of this epoch
  Eigen::VectorXd best;               // values with the lowest loss of all epochs with the same samples
  double best_loss = std::numeric_limits<double>::infinity();
  int best_epoch = -1;
  std::vector<double> losses;  // of every update's batch
  std::vector<Epoch> epochs;   // finished epochs
};

/// Time of an update: seconds summed over all threads.
struct UpdateSeconds {
  BatchSeconds batch;
  double all = 0;
  std::size_t windows = 0;  // number in the update
  double networks() const { return batch.gradients.steps.networks + batch.gradients.adjoints.networks; }
  double solver() const { return batch.gradients.steps.rest() + batch.gradients.adjoints.rest(); }
  double overhead() const { return all - networks() - solver(); }
};

enum class TrainingEnd { epochs, patience, no_progress, not_finite, stopped };
std::string describe(TrainingEnd end);

/// Position at which a training diverged.
struct Divergence {
  int update = 0, epoch = 0;
  Window window;
  WindowBatches::Reason why;
};

/// Result of a training, from its checkpoint.
struct FoundValues {
  std::string task, unknowns;   // see names_and_sizes
  Eigen::VectorXd start, best;  // start values; best values, or the start before the end of the first epoch
  double best_loss = 0;         // infinite in that case
};
/// Returns nullopt if the checkpoint is damaged. It may belong to another training, or to another version of the task.
std::optional<FoundValues> found_in(std::string_view checkpoint);
/// Names and sizes of unknowns: "nu 1, corrector 450".
std::string names_and_sizes(const std::vector<UnknownPart>& parts);

class Trainer {
 public:
  /// `epochs` > 0 overrides the task's. `trial`: see Trials. Returns null if `sink` has errors afterwards. The scene
  /// must outlive the result.
  static std::unique_ptr<Trainer> open(const TrainingScene& scene, int epochs, const BatchOptions& options,
                                       DiagnosticSink& sink, int trial = 0);

  /// Called after every update; returning false stops.
  using Watch = std::function<bool(const Trainer&)>;
  TrainingEnd run(const Watch& watch);
  /// Frees memory that only run() needs.
  void free_memory();

  /// Makes updates with samples of the losses' length, without changing the state, and returns the times of the fastest
  /// one, which was disturbed least by other processes. Requires options.is_timed.
  UpdateSeconds time_updates(int repeats);

  const TrainingState& state() const { return state_; }
  const TrainingScene& scene() const { return scene_; }
  int epochs() const { return epochs_; }
  std::int64_t updates() const { return updates_in_all_; }  // if no epoch is skipped
  const Eigen::VectorXd& start() const { return start_; }
  /// The best values so far, or the start before the end of the first epoch.
  const Eigen::VectorXd& best() const { return state_.best_epoch < 0 ? start_ : state_.best; }
  const std::optional<Divergence>& divergence() const { return divergence_; }
  /// Number of samples an epoch learns from, without those reserved for validation.
  std::size_t windows(int epoch) const;
  const std::vector<UnknownPart>& parts() const { return parts_; }
  const std::vector<Window>& validation() const { return validation_; }

  /// The checkpoint as content of a file, with its identification.
  std::string save() const;
  /// Returns false and reports bad-array-file or restart-differs on failure.
  bool restore(std::string_view bytes, const std::string& file, DiagnosticSink& sink);

 private:
  Trainer(const TrainingScene& scene, const BatchOptions& options, int trial)
      : scene_(scene),
        options_(options),
        trial_(static_cast<std::uint64_t>(trial) + options.seed),
        seed_(scene.training().seed + trial_) {}
  void begin_networks_anew();
  int largest_batch() const { return takes_all() ? std::numeric_limits<int>::max() : scene_.training().batch; }
  bool split_runs(DiagnosticSink& sink);
  int unroll_of(int epoch) const;
  std::vector<Window> windows_of(int unroll) const;
  const std::vector<Window>& order_of(int epoch);
  bool is_out_of_patience() const;
  WindowBatches& batches(int unroll);
  bool is_newton() const { return scene_.task().optimiser->kind == model::Optimiser::Kind::newton_cg; }
  /// Whether each update uses all samples.
  bool takes_all() const { return is_newton() || scene_.task().optimiser->kind == model::Optimiser::Kind::lbfgs; }
  bool make_update(std::span<const Window> batch, std::size_t first);
  bool make_next_update();
  Eigen::VectorXd scale_at(const Eigen::VectorXd& gradient) const;
  bool iterate_over_all();
  bool make_iteration(TrainingState& next, std::span<const Window> all, const Objective& loss);
  bool end_epoch();
  void diverge(std::span<const Window> batch, std::size_t bad, const Eigen::VectorXd& x);
  bool is_stopping() const { return options_.stop != nullptr && options_.stop->load(); }
  driver::RunIdentity identity() const;

  const TrainingScene& scene_;
  BatchOptions options_;
  std::uint64_t trial_, seed_;
  UpdateRule rule_;
  Bounds bounds_;
  int epochs_ = 0;
  std::int64_t updates_in_all_ = 0;
  int training_runs_ = 0, last_training_start_ = 0;
  std::vector<Window> validation_;
  std::vector<double> deviations_;
  std::unique_ptr<WindowBatches> batches_, full_;  // samples of the present epoch; validation
  Eigen::VectorXd start_;
  std::vector<UnknownPart> parts_;
  std::vector<Window> order_;
  int order_epoch_ = -1;  // epoch of order_
  TrainingState state_;
  std::optional<Divergence> divergence_;
  TrainingEnd end_ = TrainingEnd::epochs;  // why it ended
};

}  // namespace dpde::training
