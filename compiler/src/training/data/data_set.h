// SPDX-License-Identifier: Apache-2.0
// Makes a data set: runs of a scene with varied parameters, one for each thread at a time, optionally down-sampled.
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

/// A variable of frames: a state of the scene, or a formula of the states.
struct FrameVariable {
  std::string name;
  model::Placement placement{};
  bool is_state = true;
  bool is_kept = true;  // else it is only needed for statistics of the runs
};

/// Frames of one run on one grid: for each variable, frame after frame; finally empty for variables that are not kept.
struct GridFrames {
  std::vector<std::vector<double>> frames;
  std::vector<analysis::Residual> residuals;  // for each state
};
struct DataRun {
  std::vector<double> params;                  // in the order of DataSet::vary
  std::vector<GridFrames> grids;               // in the order of DataSet::grids
  std::vector<analysis::Integrals> integrals;  // for each variable, on the scene's own grid
  double cpu_seconds = 0;                      // for the frames
};

/// Error estimate of a run by Richardson extrapolation, from runs with twice and four times the scene's spacing and
/// step.
struct OrderEstimate {
  std::string variable;
  double difference = 0;     // RMS difference from the run with twice the spacing, near the first frame after the start
  double order = 0;          // log2 of the ratio of successive differences
  std::string why_not = {};  // reason why the numbers are meaningless; "" if they are valid
  bool is_known() const { return why_not.empty(); }
  double error() const;  // error of the run itself, for that order
};

struct DataSetOptions {
  model::Selection selection;  // settings from the command line
  std::optional<driver::Backend> backend;
  std::shared_ptr<codegen::CodeCache> cache;
  int threads = 1;
  const std::atomic<bool>* stop = nullptr;
  std::function<bool(driver::Session&, DiagnosticSink&)> judge = {};  // for each run; unset: all are made
};

class DataSetMaker {
 public:
  /// Returns null if `sink` has errors afterwards.
  static std::unique_ptr<DataSetMaker> open(const SourceFile& source, model::DataSet set, const DataSetOptions& options,
                                            DiagnosticSink& sink);

  const model::DataSet& set() const { return set_; }
  /// The scene without variation, for names, grid and text.
  driver::Session& session() { return *session_; }
  const std::vector<double>& times() const { return times_; }
  /// The states in the order of the rollout, followed by formulas.
  const std::vector<FrameVariable>& variables() const { return variables_; }
  /// Cells of the frames: those of the scene, coarsened.
  std::vector<int> cells(const model::DataSet::Grid& grid) const;
  /// Hash of everything that the runs depend on.
  std::uint64_t key() const;

  /// Makes the runs for which `is_done` is false; `take` gets them in any order, one at a time. Returns false after a
  /// diagnostic, and if stopped.
  using Take = std::function<void(int run, const DataRun& data)>;
  bool make(const std::function<bool(int run)>& is_done, const Take& take, DiagnosticSink& sink);
  /// For the first run and each kept variable.
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
  int first_ = 0, every_ = 1;  // steps of the first frame and between frames
  std::uint64_t files_ = 0;    // hash of the files that the scene reads
};

}  // namespace dpde::training
