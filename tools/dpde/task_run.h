// SPDX-License-Identifier: Apache-2.0
// What `gradient` and `optimize` share: a task compiled with its adjoint, with data loaded and unknowns in one vector.
#pragma once

#include <memory>
#include <string>

#include "analysis/certificate/quick_certificate.h"
#include "command.h"
#include "driver/scene/inverse.h"

namespace dpde::tools {

struct TaskOptions : CommonOptions {
  std::string memory;                                                  // --memory
  analysis::Certifying certifying = analysis::Certifying::when_cheap;  // --certify, --no-certify
  std::string checkpoint_folder;                                       // --checkpoints-in
};

struct TaskRun {
  std::shared_ptr<const driver::Compiled> compiled;
  std::optional<analysis::QuickCertificate> certificate;
  std::unique_ptr<driver::Session> session;
  std::unique_ptr<driver::Inverse> inverse;

  const model::Task& task() const { return *session->problem().task; }
};

void add_task_options(CLI::App& verb, TaskOptions& options, const Console& console);
/// Those of them that say where states are stored.
void add_storage_options(CLI::App& verb, TaskOptions& options);

/// Compiles the task with its adjoints and certifies them; false and diagnostics when anything is wrong.
bool compile_task(Job& job, const TaskOptions& options, const driver::CompileOptions& wanted, TaskRun& run);
/// --memory; nullopt after a diagnostic.
std::optional<std::int64_t> checkpoint_bytes(Job& job, const TaskOptions& options);

/// The job's source is loaded. False and diagnostics when anything is wrong.
bool open_task(Job& job, const TaskOptions& options, TaskRun& run, double runs = 1);

/// What --json says about the certificate: null where there is none.
Json certificate_json(const TaskRun& run);
/// Says it as text, where there is one, once all that the task needs is there: never behind an error.
void say_certificate(Job& job, const TaskRun& run);
/// A warning where a run until steady ends too far from rest for its loss; false where it does not.
bool warn_of_unrest(Job& job, const model::Problem& problem, const SteadyAdjoint& adjoint);
/// Of a task of a steady state, by all unknowns.
struct SteadyGradients {
  Eigen::VectorXd own;           // the last that was computed
  Eigen::VectorXd first = {};    // where an optimiser began; none: of size 0
  Eigen::VectorXd at_rest = {};  // see driver::Inverse::value_and_gradient_at_rest
};
/// The same, or one where it does for its gradient, which differs from that of the state at rest: of each unknown
/// compared with its own, or the first where that is larger. One gradient more.
void warn_of_unrest(Job& job, TaskRun& run, const Eigen::VectorXd& x, double loss, SteadyGradients gradients);
/// Warnings of the run with these unknowns: states that grow as in unstable steps, flow that comes in through open
/// ends, constraints that are missed at the end.
void warn_of_run(Job& job, TaskRun& run, const Eigen::VectorXd& x);

/// The tests of a task that does not learn from trajectories: by name, and the seconds that they took.
struct OwnTests {
  Json values = Json::object();
  double seconds = 0;
};
/// Told, with what warn_of_run has to say. One that is no finite number is an error, unless there is one already; so is
/// Ctrl-C, where `if_stopped` says how they are run after all.
OwnTests run_own_tests(Job& job, TaskRun& run, const Eigen::VectorXd& x, const std::string& if_stopped);

/// What may help where the loss or its gradient is not finite where the task begins. The session's run is another one
/// afterwards.
std::string help_at_start(const TaskRun& run, bool has_loss);

/// Of the part of a flat vector that belongs to an unknown.
double norm_of(const Eigen::VectorXd& x, const driver::Inverse::Part& part);

}  // namespace dpde::tools
