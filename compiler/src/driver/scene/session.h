// SPDX-License-Identifier: Apache-2.0
// A compiled scene ready to run: an engine with the data of files and of other scenes' runs. It holds the scene's own
// values; Inverse handles a task that starts elsewhere.
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
  int slots = 0;                  // overrides checkpoint_bytes
  std::string checkpoint_folder;  // file of stored states of gradients; checkpoint_bytes is then not limited by memory
  const std::atomic<bool>* stop = nullptr;  // checked before each step
  /// Called for each scene that is run to make data. If it returns false, after a diagnostic, that scene is not run.
  /// Unset: all are run.
  std::function<bool(Session&, DiagnosticSink&)> judge = {};
  /// Cell counts of another grid of the same shape, for verification: files are resampled, data made up.
  std::vector<int> cells;
  std::optional<int> steps;   // overrides the scene's steps
  bool trusts_signs = false;  // EngineOptions::trusts_signs
  bool made_up = false;       // with `cells`: values of files are made up too, and no file is read
  /// Starts with this training sample and its data; the steps are then whole frames.
  std::shared_ptr<const WindowStart> window = nullptr;
};

/// States of one datum: one for all times, or one for each of `times`.
struct DataStates {
  std::string name;
  std::vector<double> times;        // empty: one state for all times
  std::vector<std::string> fields;  // names in the workspace
};

/// |computed - exact| of one state. l1 and l2 are means over the cells (l2 with root).
struct ErrorNorms {
  std::string field;
  double l1 = 0, l2 = 0, linf = 0;
  double scale = 0;  // root mean square of the exact solution
};

class Session {
 public:
  /// `compiled` must have a problem and code. Returns null if `sink` has errors afterwards.
  static std::unique_ptr<Session> open(const SourceFile& source, std::shared_ptr<const Compiled> compiled,
                                       const SessionOptions& options, DiagnosticSink& sink);

  ~Session();

  const Compiled& compiled() const { return *compiled_; }
  /// For another session of the same code.
  const std::shared_ptr<const Compiled>& shared_compiled() const { return compiled_; }
  const model::Problem& problem() const { return *compiled_->problem; }
  const SessionOptions& options() const { return options_; }
  Engine& engine() { return *engine_; }
  Workspace& workspace() { return engine_->workspace(); }
  const Workspace& workspace() const { return engine_->workspace(); }
  RolloutSetup setup() const { return engine_->setup(); }
  /// With losses and adjoints, if there is a task.
  Rollout& rollout() { return engine_->primary(); }
  int steps() const { return steps_; }
  bool is_until_steady() const { return engine_->scene().steady > 0; }
  double end_time() const { return problem().t_begin + steps_ * problem().step; }
  double time_of(int step) const { return problem().t_begin + step * problem().step; }
  const std::vector<DataStates>& data() const { return data_; }
  /// Fields computed from the scene's state at that time, by a text that identifies them: see
  /// stability/frozen/zero_step.h.
  using Findings = std::map<std::string, std::map<std::string, std::vector<double>>>;
  Findings& findings() { return findings_; }

  /// The grid's axes, with `cells` applied.
  const std::vector<model::Axis>& axes() const { return axes_; }
  /// "3, 4" for a cell, and "x = 0.1, y = 0.2" for its centre.
  std::string cell_text(const Cell& cell) const;
  std::string place_text(const Cell& cell) const;

  std::vector<double> initial(int state);
  /// Final state of the last run.
  std::vector<double> final_state(int state);

  /// Values of the observables at a state of the run.
  std::vector<std::pair<std::string, double>> observe(double t, const std::vector<void*>& states);
  /// Values of the outputs' non-state fields, by name.
  std::map<std::string, std::vector<double>> shown(double t, const std::vector<void*>& states);
  /// Error of each constraint: the largest residual, and the magnitude of its terms.
  struct Miss {
    std::string multiplier;
    double value = 0, terms = 0;
    Origin origin;
  };
  std::vector<Miss> misses(double t, const std::vector<void*>& states);
  /// Error norms of the states that have an exact solution.
  std::vector<ErrorNorms> errors(double t, const std::vector<void*>& states);
  /// Pointer to a datum at a time; null if it has none.
  void* datum_at(const DataStates& datum, double t);
  /// Step numbers of the states at which a quantity is evaluated.
  std::vector<int> steps_of(const model::When& when) const { return driver::steps_of(when, problem(), steps_); }
  /// Value of a quantity of the task (a loss or test) at one state.
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
  std::string tuning_;  // the rollout's tuning found in the cache
};

/// Reports `error` as a diagnostic: input, run or machine.
void report_error(const std::exception& error, DiagnosticSink& sink, SourceRange range = {});

}  // namespace dpde::driver
