// SPDX-License-Identifier: Apache-2.0
// A compiled scene ready to run: an engine with what files and other scenes' runs say of it, as the scene has it: where
// its task begins elsewhere, Inverse knows that.
#pragma once

#include <atomic>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dpde/runtime/engine.h"
#include "driver/compile/pipeline.h"
#include "driver/memory/storage.h"
#include "driver/scene/scene_table.h"

namespace dpde::driver {

class Session;
struct WindowStart;

struct SessionOptions {
  int threads = 1;
  std::int64_t checkpoint_bytes = std::numeric_limits<std::int64_t>::max();
  int slots = 0;  // overrides checkpoint_bytes
  std::string
      checkpoint_folder;  // states of gradients lie in a file there; checkpoint_bytes is then not held to memory
  const std::atomic<bool>* stop = nullptr;  // looked at before each step
  /// Of each scene that is run to make data: where it is false, after a diagnostic, there is no run. Unset: all are
  /// run.
  std::function<bool(Session&, DiagnosticSink&)> judge = {};
  /// Another grid of the same shape, one number an axis, for verification: files are resampled, data made up.
  std::vector<int> cells;
  std::optional<int> steps;   // in place of the scene's
  bool trusts_signs = false;  // EngineOptions::trusts_signs
  bool made_up = false;       // with `cells`: what files hold is made up too, and no file is read
  /// It begins there, with the data of that window; steps are whole frames then.
  std::shared_ptr<const WindowStart> window = nullptr;
};

/// States of one datum: one for all times, or one for each of `times`.
struct DataStates {
  std::string name;
  std::vector<double> times;        // empty: one state for all times
  std::vector<std::string> fields;  // of the workspace
};

/// |computed - exact| of one state; l1 and l2 are means over the cells (l2 its root).
struct ErrorNorms {
  std::string field;
  double l1 = 0, l2 = 0, linf = 0;
  double scale = 0;  // root mean square of the exact solution
};

class Session {
 public:
  /// `compiled` has a problem and code. null when `sink` has errors afterwards.
  static std::unique_ptr<Session> open(const SourceFile& source, std::shared_ptr<const Compiled> compiled,
                                       const SessionOptions& options, DiagnosticSink& sink);

  ~Session();

  const Compiled& compiled() const { return *compiled_; }
  /// For another session of the same.
  const std::shared_ptr<const Compiled>& shared_compiled() const { return compiled_; }
  const model::Problem& problem() const { return *compiled_->problem; }
  const SessionOptions& options() const { return options_; }
  Engine& engine() { return *engine_; }
  Workspace& workspace() { return engine_->workspace(); }
  const Workspace& workspace() const { return engine_->workspace(); }
  RolloutSetup setup() const { return engine_->setup(); }
  /// With losses and adjoints, where there is a task.
  Rollout& rollout() { return engine_->primary(); }
  int steps() const { return steps_; }
  bool is_until_steady() const { return engine_->scene().steady > 0; }
  double end_time() const { return problem().t_begin + steps_ * problem().step; }
  double time_of(int step) const { return problem().t_begin + step * problem().step; }
  const std::vector<DataStates>& data() const { return data_; }
  /// Fields that were made of the scene as it stood then, by a text that says of what: see
  /// stability/frozen/zero_step.h.
  using Findings = std::map<std::string, std::map<std::string, std::vector<double>>>;
  Findings& findings() { return findings_; }

  /// The grid's axes, `cells` applied.
  const std::vector<model::Axis>& axes() const { return axes_; }
  /// "3, 4" for a cell and "x = 0.1, y = 0.2" for its centre.
  std::string cell_text(const Cell& cell) const;
  std::string place_text(const Cell& cell) const;

  std::vector<double> initial(int state);
  /// The state where the last run ended.
  std::vector<double> final_state(int state);

  /// Values of the observables at a state of the run.
  std::vector<std::pair<std::string, double>> observe(double t, const std::vector<void*>& states);
  /// Values of what outputs ask for beside states, by name.
  std::map<std::string, std::vector<double>> shown(double t, const std::vector<void*>& states);
  /// How far each constraint is from being true: the largest value of what has to be 0, and what its terms are like.
  struct Miss {
    std::string multiplier;
    double value = 0, terms = 0;
    Origin origin;
  };
  std::vector<Miss> misses(double t, const std::vector<void*>& states);
  /// Distance from the exact solution, for the states that have one.
  std::vector<ErrorNorms> errors(double t, const std::vector<void*>& states);
  /// The pointer a datum has at a time; null when it has none.
  void* datum_at(const DataStates& datum, double t);
  /// The states a quantity is evaluated at, as step numbers.
  std::vector<int> steps_of(const model::When& when) const { return driver::steps_of(when, problem(), steps_); }
  /// A quantity of the task (a loss or test) at one state.
  double evaluate(const dpde_program& program, const std::string& sum, double t, const std::vector<void*>& states);

 private:
  Session() = default;
  EngineOptions engine_options();
  bool load(const SourceFile& source, DiagnosticSink& sink);
  bool load_data(const SourceFile& source, DiagnosticSink& sink);
  void load_window();
  std::vector<double> on_grid(const std::vector<double>& values) const;
  bool has_data_for_losses(DiagnosticSink& sink);
  bool load_coefficients(const SourceFile& source, DiagnosticSink& sink);
  bool load_states(const SourceFile& source, DiagnosticSink& sink);
  bool coefficients_finite(DiagnosticSink& sink);
  bool starts_finite(DiagnosticSink& sink);
  Workspace::Bound bind_states(const std::vector<void*>& states);

  std::shared_ptr<const Compiled> compiled_;
  SessionOptions options_;
  int steps_ = 0;
  std::vector<model::Axis> axes_;
  std::shared_ptr<const SceneTable> table_;
  std::unique_ptr<Engine> engine_;
  std::vector<DataStates> data_;
  Findings findings_;
  std::string tuning_;  // of the rollout, as it was found in the cache
};

/// What `error` says as a diagnostic: input, run or machine.
void report_error(const std::exception& error, DiagnosticSink& sink, SourceRange range = {});

}  // namespace dpde::driver
