// SPDX-License-Identifier: Apache-2.0
// Learns the unknowns of a task from trajectories: epochs over all windows in random order, one update a batch; or
// iterations of L-BFGS or of Newton's method, each an epoch with one update by all windows. Deterministic: what was
// stopped and is taken up again gives the same numbers to the last bit, for any number of threads.
#pragma once

#include <filesystem>
#include <functional>
#include <limits>

#include "dpde/runtime/optimise.h"
#include "dpde/runtime/update_rule.h"
#include "driver/report/restart_file.h"
#include "training/data/window_batches.h"

namespace dpde::training {

/// One pass over all windows.
struct Epoch {
  int unroll = 1;   // steps of its windows
  double loss = 0;  // mean over its batches, each at the values it was computed with; of all windows at those after it
  double validation = 0;     // at the values after it; not a number without validation
  double rate = 0;           // of its last update; 0: it has none
  std::int64_t updates = 0;  // made by its end
};

/// Everything that goes into a checkpoint: from it a training goes on as if it had not stopped.
struct TrainingState {
  UpdateState updates;
  LbfgsState lbfgs;                   // of L-BFGS once it has begun; of Newton's method with no pairs
  double first_norm = 0, radius = 0;  // of Newton's method (see NewtonCgState)
  Eigen::VectorXd scale;              // of each unknown, as L-BFGS takes it; empty: none
  int epoch = 0, batch = 0;           // the next one
  double epoch_loss = 0;              // sum over the batches of this epoch so far
  Eigen::VectorXd best;               // values with the lowest loss of all epochs of the same windows
  double best_loss = std::numeric_limits<double>::infinity();
  int best_epoch = -1;
  std::vector<double> losses;  // of every update's batch
  std::vector<Epoch> epochs;   // that are over
};

/// Where the time of an update goes: seconds of all threads together.
struct UpdateSeconds {
  BatchSeconds batch;
  double all = 0;
  std::size_t windows = 0;  // of the update
  double networks() const { return batch.gradients.steps.networks + batch.gradients.adjoints.networks; }
  double solver() const { return batch.gradients.steps.rest() + batch.gradients.adjoints.rest(); }
  double overhead() const { return all - networks() - solver(); }
};

enum class TrainingEnd { epochs, patience, no_progress, not_finite, stopped };
std::string describe(TrainingEnd end);

/// Where a training that diverged did so.
struct Divergence {
  int update = 0, epoch = 0;
  Window window;
  WindowBatches::Reason why;
};

/// What a training has found, as its checkpoint has it.
struct FoundValues {
  std::string task, unknowns;   // see names_and_sizes
  Eigen::VectorXd start, best;  // where it began; the best values, or the start where no epoch is over
  double best_loss = 0;         // infinite then
};
/// nullopt when the checkpoint is damaged. It may be of another training, and of another state of the task's text.
std::optional<FoundValues> found_in(std::string_view checkpoint);
/// Names and sizes: "nu 1, corrector 450".
std::string names_and_sizes(const std::vector<UnknownPart>& parts);

class Trainer {
 public:
  /// `epochs` > 0 in place of the task's. `trial`: see Trials. null when `sink` has errors afterwards. The scene must
  /// outlive the result.
  static std::unique_ptr<Trainer> open(const TrainingScene& scene, int epochs, const BatchOptions& options,
                                       DiagnosticSink& sink, int trial = 0);

  /// Called after every update; false stops.
  using Watch = std::function<bool(const Trainer&)>;
  TrainingEnd run(const Watch& watch);
  /// What only run() needs.
  void free_memory();

  /// Makes updates with windows of the losses' own length and leaves the state as it is: the fastest one, which others
  /// on the machine disturbed least. options.is_timed.
  UpdateSeconds time_updates(int repeats);

  const TrainingState& state() const { return state_; }
  const TrainingScene& scene() const { return scene_; }
  int epochs() const { return epochs_; }
  std::int64_t updates() const { return updates_in_all_; }  // when no epoch is left out
  const Eigen::VectorXd& start() const { return start_; }
  /// The best values so far, or the start where no epoch is over.
  const Eigen::VectorXd& best() const { return state_.best_epoch < 0 ? start_ : state_.best; }
  const std::optional<Divergence>& divergence() const { return divergence_; }
  /// Windows an epoch learns from, and those that are kept for validation.
  std::size_t windows(int epoch) const;
  const std::vector<UnknownPart>& parts() const { return parts_; }
  const std::vector<Window>& validation() const { return validation_; }

  /// The checkpoint as bytes of a file, with what it is of.
  std::string save() const;
  /// Reports bad-array-file and restart-differs; false then.
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
  /// All windows in each update.
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
  std::unique_ptr<WindowBatches> batches_, full_;  // of the present epoch's windows, and for validation
  Eigen::VectorXd start_;
  std::vector<UnknownPart> parts_;
  std::vector<Window> order_;
  int order_epoch_ = -1;  // that order_ is of
  TrainingState state_;
  std::optional<Divergence> divergence_;
  TrainingEnd end_ = TrainingEnd::epochs;  // why it could not go on
};

}  // namespace dpde::training
