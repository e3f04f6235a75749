// SPDX-License-Identifier: Apache-2.0
// Losses and gradients of training samples ("windows" of trajectories) in parallel: one simulation for each thread.
// Sums are in the order of the samples, so results are the same to the last bit for any number of threads.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dpde/runtime/optimise.h"
#include "dpde/runtime/simulation.h"
#include "dpde/runtime/team.h"
#include "dpde/runtime/unsolved.h"
#include "driver/scene/scene_table.h"
#include "files/trajectories.h"

namespace dpde::training {

/// A training sample: the frames of a run from `frame` on.
struct Window {
  int run = 0, frame = 0;
};

/// A task that learns from trajectories, ready to run: its scene, its data, and the scene's values from files.
struct TrainingScene {
  std::shared_ptr<const driver::Compiled> compiled;
  std::shared_ptr<const driver::SceneTable> table;
  files::Trajectories trajectories;
  /// Initial states that are not in the trajectories, and coefficients.
  std::vector<std::pair<std::string, std::vector<double>>> given_states, given_fields;
  std::uint64_t given_hash = 0;  // of all files except the trajectories
  double own_step = 0;           // time step of the task's scene, the unit for steps of tests

  /// Returns null if `sink` has errors afterwards. `compiled` must keep its parameters (Selection::keeps_params) and
  /// have adjoints.
  static std::unique_ptr<TrainingScene> open(const SourceFile& source, std::shared_ptr<const driver::Compiled> compiled,
                                             DiagnosticSink& sink);
  /// The same for a scene that only runs, from frames of `on`; messages refer to `where`.
  static std::unique_ptr<TrainingScene> open_on(const SourceFile& source,
                                                std::shared_ptr<const driver::Compiled> compiled,
                                                files::Trajectories on, SourceRange where, DiagnosticSink& sink);

  const model::Task& task() const { return *compiled->problem->task; }
  const model::Training& training() const { return *task().training; }
  /// Length of the samples for which losses are written.
  int steps() const { return compiled->problem->steps; }
  /// Number of first frames possible for a sample of `steps` steps.
  int starts(int steps) const;
  /// Sets the scene's values from files in a simulation.
  void give(Simulation& simulation) const;
  /// Sets a simulation to a frame: time, parameters of the run, initial states.
  void begin(Simulation& simulation, const files::Trajectories& from, const Window& window) const;
};

/// Reports and returns false if runs of a file differ in parameters that the compiler needed as numbers.
bool runs_are_of_this_scene(const TrainingScene& scene, const files::Trajectories& trajectories, SourceRange where,
                            DiagnosticSink& sink);

/// Noise added to the initial states of samples: Gaussian with a given deviation for each state, drawn by seed and
/// stream.
struct StartNoise {
  std::vector<double> deviations;  // in the order of Trajectories::states; empty: no noise
  std::uint64_t seed = 0, stream = 0;
};

struct BatchOptions {
  int threads = 1, cut = 0;
  std::int64_t checkpoint_bytes = std::numeric_limits<std::int64_t>::max();  // for all simulations together
  const std::atomic<bool>* stop = nullptr;
  std::uint64_t seed = 0;     // added to the seeds of sample order, noise and initial weights
  bool stores_states = true;  // false: only losses are computed
  bool is_timed = false;      // measure for WindowBatches::seconds()
};

/// Time spent on gradients, summed over all threads.
struct BatchSeconds {
  GradientSeconds gradients;
  double waiting = 0;  // idle threads that had finished their samples
};

/// An unknown and its part of the vector of unknowns.
struct UnknownPart {
  std::string name;
  std::int32_t kind = 0;  // DPDE_UNKNOWN_PARAM ...
  double low = 0, high = 0;
  Eigen::Index offset = 0, size = 0;
};

/// Parts of all unknowns, in order.
std::vector<UnknownPart> parts_of(const dpde_scene& scene, Simulation& simulation);

class WindowBatches {
 public:
  /// For samples of `steps` steps. @throws Error if memory runs out.
  WindowBatches(const TrainingScene& scene, int steps, int largest_batch, const BatchOptions& options);
  ~WindowBatches();

  struct Result {
    double loss = 0;                 // mean over the samples
    std::optional<std::size_t> bad;  // first sample whose loss or gradient is not finite
  };
  /// `gradient` must have the size of x. Sample i uses the noise stream noise.stream + i.
  Result gradient(const Eigen::VectorXd& x, std::span<const Window> windows, const StartNoise& noise,
                  Eigen::VectorXd& gradient);
  Result loss(const Eigen::VectorXd& x, std::span<const Window> windows);
  /// Hessian of the mean loss times a direction; returns false if it is not finite. @throws Error if a loss has none.
  bool product(const Eigen::VectorXd& x, const Eigen::VectorXd& direction, std::span<const Window> windows,
               Curvature curvature, Eigen::VectorXd& result);
  /// Why a sample has no loss or gradient.
  struct Reason {
    std::string states = {};            // where they become infinite or NaN, as text; "": they are finite
    std::optional<Unsolved> jump = {};  // an assumption of the derivatives fails in the sample
  };
  Reason why_not_finite(const Eigen::VectorXd& x, const Window& window);

  /// Start values of the task's unknowns.
  Eigen::VectorXd unknown_values();
  std::vector<UnknownPart> parts();
  int steps() const { return steps_; }
  std::size_t threads() const { return simulations_.size(); }
  /// Calls `work`, in parallel, with a simulation set to each sample. Sample i uses the noise stream noise.stream +
  /// first + i.
  using Work = std::function<void(Simulation& simulation, std::size_t number)>;
  void for_each(const Eigen::VectorXd& x, std::span<const Window> windows, const StartNoise& noise, std::size_t first,
                const Work& work);
  /// Seconds since the last call.
  BatchSeconds take_seconds();

 private:
  void begin(Simulation& simulation, const Eigen::VectorXd& x, const Window& window, const StartNoise& noise,
             std::uint64_t number);
  /// Result for one sample: a number, which is summed, and optionally a vector of the size of x.
  using Question = std::function<double(Simulation& simulation, Eigen::VectorXd& vector)>;
  /// `sum`: of the vectors; null if there are none.
  Result over(const Eigen::VectorXd& x, std::span<const Window> windows, const StartNoise& noise,
              const Question& question, Eigen::VectorXd* sum);

  const TrainingScene& from_;
  std::int32_t steps_;
  std::vector<std::int32_t> at_;  // states at which losses are evaluated
  std::vector<dpde_loss> losses_;
  std::vector<dpde_datum> data_;
  dpde_scene scene_;
  bool is_timed_;
  std::deque<GradientSeconds> seconds_;  // one for each thread, like the following
  std::vector<double> busy_;
  double region_ = 0;  // duration of the parallel regions
  Team team_;
  std::deque<Simulation> simulations_;
  std::vector<Eigen::VectorXd> vectors_;
};

}  // namespace dpde::training
