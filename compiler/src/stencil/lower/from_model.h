// SPDX-License-Identifier: Apache-2.0
// From equations to kernels: every derivative becomes a difference, every time step a program.
//
// The programs (those that apply) in this order, S the scene and T the task; "kept" fields are results:
//   S_coefficients  coefficient fields from formulas, kept          S_initial  states from formulas, kept
//   T_start         control initial states from formulas, kept      S_step     one step, swap (u, u_next)
//   S_trial    a step with a sum that estimates its error, if a tolerance determines the step size
//   S_control_1, .. a control field from its formula of t, kept     T_control_1, ...  the same at the start of a task
//   S_exact         u_exact of the states that have one, kept       S_observe  a sum for each observable
//   S_shown         outputs other than states, kept                 T_test_N   sum N
//   T_loss_1, ...   sum `loss`, one program per `minimise` line
//   T_watched       values whose signs derivatives assume constant, kept; built by program_of_values
//   T_watched_step  S_step or S_trial with the signs of these values in each stage; built by watched_step
// and one loop of S_step over the steps. A problem whose step is a hand-written program gets no step and no loop.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "model/model.h"
#include "source/diagnostic.h"
#include "stencil/stencil.h"

namespace dpde::stencil {

/// Names of the programs, whether or not they exist: as above, or S_step_2 if another program is called S_step.
struct ProgramNames {
  std::string step, trial, coefficients, initial, rate, exact, observe, shown, start, constraints, watched,
      watched_step;
  std::string rate_field = "courant_rate";  // result of `rate`; users cannot name a field so
  /// Sums of `constraints` for each constraint, in order: the largest residual, and the largest sum of its terms'
  /// magnitudes.
  std::vector<std::pair<std::string, std::string>> misses;
  std::vector<std::string> losses;           // in the order of the task
  std::map<std::string, std::string> tests;  // by the quantity
  /// Programs of control fields: by the scene's formula, and by the formula for the start of a task. Each is run once
  /// per interval, with t at its middle.
  std::map<std::string, std::string> controls, control_starts;
};
/// Names for the programs of a problem; `step` is the user's program if there is one, and no other has its name.
ProgramNames program_names(const model::Problem& problem);

/// Lowers a verified problem. Expressions that no scheme can discretise are reported, and the module is then empty.
Module from_model(const model::Problem& problem, const ProgramNames& names, DiagnosticSink& sink);

/// One program that keeps a field for each of the values, in their order.
Module program_of_values(const model::Problem& problem, const std::string& name,
                         const std::vector<model::Expr>& values);

/// A value that occurs only in the equations of these states and in events of each step, or in one other event. If
/// none of these is set it may occur anywhere.
struct WatchedValue {
  model::Expr value;
  std::set<std::string> equations = {};
  bool is_in_each_step = false;           // in events of each step
  std::optional<std::size_t> event = {};  // index in the problem's events
};

/// The states that record the signs of a value, and their swaps in a step.
struct SidesMarked {
  std::string below, above;  // "": no stage evaluates the value
  std::vector<Swap> swaps;
};

/// A step (a trial step if there is a tolerance) with two states per value, in the order of the values, that record the
/// value's signs in its stages. Values that no stage evaluates have no states. The module has no program if the scene
/// has no equations.
struct WatchedStep {
  Module module;
  std::vector<SidesMarked> marks;
};
WatchedStep watched_step(const model::Problem& problem, const std::string& name,
                         const std::vector<WatchedValue>& values);

}  // namespace dpde::stencil
