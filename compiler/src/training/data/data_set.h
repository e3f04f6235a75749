// SPDX-License-Identifier: Apache-2.0
// Makes a data set: the runs of a scene with varied parameters, each on a thread, down-sampled where that is wanted.
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "analysis/certificate/residual.h"
#include "analysis/run/conservation.h"
#include "driver/scene/session.h"
#include "model/data_set_from_ast.h"

namespace dpde::training {

/// What frames are of: a state of the scene, or a formula of the states.
struct FrameVariable {
  std::string name;
  model::Placement placement{};
  bool is_state = true;
  bool is_kept = true;  // else it is there for what is told of the runs
};

/// One run's frames on one grid: of each variable, one after the other; of those that are not kept none in the end.
struct GridFrames {
  std::vector<std::vector<double>> frames;
  std::vector<analysis::Residual> residuals;  // of the states
};
struct DataRun {
  std::vector<double> params;                  // in the order of DataSet::vary
  std::vector<GridFrames> grids;               // in the order of DataSet::grids
  std::vector<analysis::Integrals> integrals;  // of the variables, on the scene's own grid
  double cpu_seconds = 0;                      // for the frames
};

/// How far a run is from finer ones: from runs on grids of the scene's, twice and four times its spacing and step.
struct OrderEstimate {
  std::string variable;
  double difference = 0;     // root of the mean square of the difference to the run with twice the spacing, about the
                             // first frame behind the start
  double order = 0;          // log2 of how much larger the next difference is
  std::string why_not = {};  // the numbers mean nothing; "" where they do
  bool is_known() const { return why_not.empty(); }
  double error() const;  // of the run itself, were it of that order
};

struct DataSetOptions {
  model::Selection selection;  // settings of the command line
  std::optional<driver::Backend> backend;
  std::shared_ptr<codegen::CodeCache> cache;
  int threads = 1;
  const std::atomic<bool>* stop = nullptr;
  std::function<bool(driver::Session&, DiagnosticSink&)> judge = {};  // of each run; unset: all are made
};

class DataSetMaker {
 public:
  /// null when `sink` has errors afterwards.
  static std::unique_ptr<DataSetMaker> open(const SourceFile& source, model::DataSet set, const DataSetOptions& options,
                                            DiagnosticSink& sink);

  const model::DataSet& set() const { return set_; }
  /// The scene as it is without variation, for names, grid and text.
  driver::Session& session() { return *session_; }
  const std::vector<double>& times() const { return times_; }
  /// The states in the order of the rollout, behind them formulas.
  const std::vector<FrameVariable>& variables() const { return variables_; }
  /// Of the frames: the scene's axes, coarsened.
  std::vector<int> cells(const model::DataSet::Grid& grid) const;
  /// Stands for everything that the runs depend on.
  std::uint64_t key() const;

  /// The runs that `is_done` does not know; `take` gets them in any order, one at a time. False after a diagnostic, and
  /// when stopped.
  using Take = std::function<void(int run, const DataRun& data)>;
  bool make(const std::function<bool(int run)>& is_done, const Take& take, DiagnosticSink& sink);
  /// Of the first run, for each variable that is kept.
  std::vector<OrderEstimate> estimate_order();

 private:
  DataSetMaker(const SourceFile& source, model::DataSet set, const DataSetOptions& options)
      : source_(source), set_(std::move(set)), options_(options) {}
  struct Making;
  void make_run(int run, Making& all) const;
  bool plan_frames(DiagnosticSink& sink);
  void plan_variables();
  std::vector<std::vector<double>> values_at(driver::Session& session, double t,
                                             const std::vector<void*>& states) const;
  using Shared = std::shared_ptr<const driver::Compiled>;
  Shared compile_run(int run, const std::map<std::string, std::string>& more, DiagnosticSink& sink) const;
  std::unique_ptr<driver::Session> session_of(std::shared_ptr<const driver::Compiled> compiled,
                                              const std::atomic<bool>* stop, DiagnosticSink& sink) const;
  std::unique_ptr<driver::Session> open_run(int run, const std::map<std::string, std::string>& more,
                                            DiagnosticSink& sink) const;
  std::vector<Shared> compile_stored(int run, const Shared& own) const;
  void add_residuals(Shared stored, GridFrames& grid) const;
  bool is_like_first(driver::Session& session, DiagnosticSink& sink) const;
  std::string why_no_order(int at) const;
  std::string run_for_order(int at, int level, std::vector<std::vector<double>>& values) const;
  bool frames_of(driver::Session& session, int first, int every, int count, DataRun& to, DiagnosticSink& sink) const;

  const SourceFile& source_;
  model::DataSet set_;
  DataSetOptions options_;
  std::unique_ptr<driver::Session> session_;
  std::vector<double> times_;
  std::vector<FrameVariable> variables_;
  int first_ = 0, every_ = 1;  // steps of the frames
  std::uint64_t files_ = 0;    // hash of what the scene takes from files
};

}  // namespace dpde::training
