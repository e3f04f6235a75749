// SPDX-License-Identifier: Apache-2.0
// Losses and gradients of windows of trajectories, several at once: one simulation a thread, sums in the order of the
// windows, so that results are the same to the last bit for any number of threads.
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

/// The frames of a run from `frame` on.
struct Window {
  int run = 0, frame = 0;
};

/// A task that learns from trajectories, ready to run: its scene, its data, and what of the scene comes from files.
struct TrainingScene {
  std::shared_ptr<const driver::Compiled> compiled;
  std::shared_ptr<const driver::SceneTable> table;
  files::Trajectories trajectories;
  /// Initial states that are not in the trajectories, and coefficients.
  std::vector<std::pair<std::string, std::vector<double>>> given_states, given_fields;
  std::uint64_t given_hash = 0;  // of all files but the trajectories
  double own_step = 0;           // of the task's scene, which steps of tests are counted in

  /// null when `sink` has errors afterwards. `compiled` keeps its parameters (Selection::keeps_params) and has
  /// adjoints.
  static std::unique_ptr<TrainingScene> open(const SourceFile& source, std::shared_ptr<const driver::Compiled> compiled,
                                             DiagnosticSink& sink);
  /// The same of a scene that only runs, from frames of `on`; messages are about `where`.
  static std::unique_ptr<TrainingScene> open_on(const SourceFile& source,
                                                std::shared_ptr<const driver::Compiled> compiled,
                                                files::Trajectories on, SourceRange where, DiagnosticSink& sink);

  const model::Task& task() const { return *compiled->problem->task; }
  const model::Training& training() const { return *task().training; }
  /// Of the windows that losses are written for.
  int steps() const { return compiled->problem->steps; }
  /// A window of so many steps may begin with frames 0 to this one less.
  int starts(int steps) const;
  /// Gives a simulation what the scene has from files.
  void give(Simulation& simulation) const;
  /// Puts it at a frame: time, parameters of the run, initial states.
  void begin(Simulation& simulation, const files::Trajectories& from, const Window& window) const;
};

/// Reports, and returns false, where the runs of a file differ in what the compiler had to know of the scene.
bool runs_are_of_this_scene(const TrainingScene& scene, const files::Trajectories& trajectories, SourceRange where,
                            DiagnosticSink& sink);

/// Of the states that windows begin with: normal numbers with the given deviation of each state, drawn by seed and
/// stream.
struct StartNoise {
  std::vector<double> deviations;  // by Trajectories::states; empty: none
  std::uint64_t seed = 0, stream = 0;
};

struct BatchOptions {
  int threads = 1, cut = 0;
  std::int64_t checkpoint_bytes = std::numeric_limits<std::int64_t>::max();  // of all simulations together
  const std::atomic<bool>* stop = nullptr;
  std::uint64_t seed = 0;     // of a training: added to the seeds of the order, of the noise and of first weights
  bool stores_states = true;  // false: only losses are asked for
  bool is_timed = false;      // WindowBatches::seconds()
};

/// Where the time of gradients went: of all threads together.
struct BatchSeconds {
  GradientSeconds gradients;
  double waiting = 0;  // of threads that were done with their windows
};

/// An unknown and its part of the vector of all of them.
struct UnknownPart {
  std::string name;
  std::int32_t kind = 0;  // DPDE_UNKNOWN_PARAM ...
  double low = 0, high = 0;
  Eigen::Index offset = 0, size = 0;
};

/// The unknowns of a scene in the order of the vector of all of them.
std::vector<UnknownPart> parts_of(const dpde_scene& scene, Simulation& simulation);

class WindowBatches {
 public:
  /// Windows of `steps` steps. @throws Error when memory runs out.
  WindowBatches(const TrainingScene& scene, int steps, int largest_batch, const BatchOptions& options);
  ~WindowBatches();

  struct Result {
    double loss = 0;                 // mean over the windows
    std::optional<std::size_t> bad;  // the first window whose loss or gradient is not a finite number
  };
  /// `gradient` has the size of x. Noise of window i has the stream noise.stream + i.
  Result gradient(const Eigen::VectorXd& x, std::span<const Window> windows, const StartNoise& noise,
                  Eigen::VectorXd& gradient);
  Result loss(const Eigen::VectorXd& x, std::span<const Window> windows);
  /// The Hessian of the mean loss times a direction; false where it is not finite. @throws Error where a loss has none.
  bool product(const Eigen::VectorXd& x, const Eigen::VectorXd& direction, std::span<const Window> windows,
               Curvature curvature, Eigen::VectorXd& result);
  /// Why a window has no loss or gradient.
  struct Reason {
    std::string states = {};            // where they are no longer finite, in words; "": they are
    std::optional<Unsolved> jump = {};  // what the derivatives take for granted changes in the window
  };
  Reason why_not_finite(const Eigen::VectorXd& x, const Window& window);

  /// Where the task starts.
  Eigen::VectorXd unknown_values();
  std::vector<UnknownPart> parts();
  int steps() const { return steps_; }
  std::size_t threads() const { return simulations_.size(); }
  /// Calls `work` with a simulation that is set to each window, several at once. Noise of window i has the stream
  /// noise.stream + first + i.
  using Work = std::function<void(Simulation& simulation, std::size_t number)>;
  void for_each(const Eigen::VectorXd& x, std::span<const Window> windows, const StartNoise& noise, std::size_t first,
                const Work& work);
  /// Since the last call.
  BatchSeconds take_seconds();

 private:
  void begin(Simulation& simulation, const Eigen::VectorXd& x, const Window& window, const StartNoise& noise,
             std::uint64_t number);
  /// What is asked of a window: a number, which is added up, and a vector of the size of x where one is.
  using Question = std::function<double(Simulation& simulation, Eigen::VectorXd& vector)>;
  /// `sum`: of the vectors; null where there are none.
  Result over(const Eigen::VectorXd& x, std::span<const Window> windows, const StartNoise& noise,
              const Question& question, Eigen::VectorXd* sum);

  const TrainingScene& from_;
  std::int32_t steps_;
  std::vector<std::int32_t> at_;  // states at which losses count
  std::vector<dpde_loss> losses_;
  std::vector<dpde_datum> data_;
  dpde_scene scene_;
  bool is_timed_;
  std::deque<GradientSeconds> seconds_;  // one a thread, as the others
  std::vector<double> busy_;
  double region_ = 0;  // of the parallel regions
  Team team_;
  std::deque<Simulation> simulations_;
  std::vector<Eigen::VectorXd> vectors_;
};

}  // namespace dpde::training
