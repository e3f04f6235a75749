// SPDX-License-Identifier: Apache-2.0
// Shared by `gradient` and `optimize`: a task compiled with its adjoint, its data, and its unknowns as one vector.
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
/// Only the options on the storage of states.
void add_storage_options(CLI::App& verb, TaskOptions& options);

/// Compiles the task with its adjoints and certifies them; returns false with diagnostics on errors.
bool compile_task(Job& job, const TaskOptions& options, const driver::CompileOptions& wanted, TaskRun& run);
/// The value of --memory; nullopt after a diagnostic.
std::optional<std::int64_t> checkpoint_bytes(Job& job, const TaskOptions& options);

/// The job's source must be loaded. Returns false with diagnostics on errors.
bool open_task(Job& job, const TaskOptions& options, TaskRun& run, double runs = 1);

/// The certificate for --json: null if there is none.
Json certificate_json(const TaskRun& run);
/// Prints it, if there is one. Call once everything for the task is set up, so that it never follows an error.
void say_certificate(Job& job, const TaskRun& run);
/// Warns if a run until steady ends too far from its steady state for the loss; returns whether it does.
bool warn_of_unrest(Job& job, const model::Problem& problem, const SteadyAdjoint& adjoint);
/// Gradients of a task of a steady state, by all unknowns.
struct SteadyGradients {
  Eigen::VectorXd own;           // the last one computed
  Eigen::VectorXd first = {};    // at the start of an optimiser; empty: none
  Eigen::VectorXd at_rest = {};  // see driver::Inverse::value_and_gradient_at_rest
};
/// The same, and a warning if the gradient differs too much from that at the fixed point: for each unknown relative to
/// its own gradient, or to the first one if that is larger. Computes one more gradient.
void warn_of_unrest(Job& job, TaskRun& run, const Eigen::VectorXd& x, double loss, SteadyGradients gradients);
/// Warnings of the run with these unknowns: states that grow as with unstable steps, inflow through open ends,
/// constraints that are violated at the end.
void warn_of_run(Job& job, TaskRun& run, const Eigen::VectorXd& x);

/// Results of the tests of a task that does not learn from trajectories, by name, and their time in seconds.
struct OwnTests {
  Json values = Json::object();
  double seconds = 0;
};
/// Runs and reports the tests, with the warnings of warn_of_run. A result that is not finite is an error, unless there
/// is one already. Ctrl-C is an error too; `if_stopped` then explains how to run the tests.
OwnTests run_own_tests(Job& job, TaskRun& run, const Eigen::VectorXd& x, const std::string& if_stopped);

/// Advice for a loss or gradient that is not finite at the start of the task. The session's run changes.
std::string help_at_start(const TaskRun& run, bool has_loss);

/// Norm of the part of a flat vector that belongs to an unknown.
double norm_of(const Eigen::VectorXd& x, const driver::Inverse::Part& part);

}  // namespace dpde::tools
