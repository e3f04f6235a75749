// SPDX-License-Identifier: Apache-2.0
// From equations to kernels: every derivative becomes a difference, every time step a program.
//
// The programs (those that apply) in this order, S the scene and T the task:
//   S_coefficients  coefficient fields from formulas, kept          S_initial  states from formulas, kept
//   T_start         unknown initial states from formulas, kept      S_step     one step, swap (u, u_next)
//   S_trial    a step with a sum that estimates its error, where a tolerance decides how long steps are
//   S_control_1, .. a control field from its formula of t, kept     T_control_1, ...  the same where a task starts
//   S_exact         u_exact of the states that have one, kept       S_observe  a sum for each observable
//   S_shown         what outputs ask for beside states, kept        T_test_N   sum N
//   T_loss_1, ...   sum `loss`, one program a `minimise` line
//   T_watched       what derivatives take for granted, kept; made by program_of_values
//   T_watched_step  S_step or S_trial with what it takes for granted in each stage; made by watched_step
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

/// What they are called, whether they are there or not: as above, or S_step_2 where another program is called S_step.
struct ProgramNames {
  std::string step, trial, coefficients, initial, rate, exact, observe, shown, start, constraints, watched,
      watched_step;
  std::string rate_field = "courant_rate";  // that `rate` keeps; a word that no field of a person has
  /// Sums of `constraints` for each constraint, in order: the largest value of what has to be 0, and the largest sum of
  /// its terms' magnitudes.
  std::vector<std::pair<std::string, std::string>> misses;
  std::vector<std::string> losses;           // in the order of the task
  std::map<std::string, std::string> tests;  // by the quantity
  /// Of control fields: of the scene's formula, and of the formula a task starts with. Run once for each interval, with
  /// t in its middle.
  std::map<std::string, std::string> controls, control_starts;
};
/// `step` is the problem's own program where a person wrote one; the others are called otherwise.
ProgramNames program_names(const model::Problem& problem);

/// Lowers a verified problem. What no scheme can discretise is reported to `sink`; the module is empty then.
Module from_model(const model::Problem& problem, const ProgramNames& names, DiagnosticSink& sink);

/// One program that keeps a field for each of the values, in their order.
Module program_of_values(const model::Problem& problem, const std::string& name,
                         const std::vector<model::Expr>& values);

/// What stands in the equations of these states and in events of each step alone, or in one of the other events; in
/// none of them: anywhere.
struct WatchedValue {
  model::Expr value;
  std::set<std::string> equations = {};
  bool is_in_each_step = false;           // in events of each step
  std::optional<std::size_t> event = {};  // of the problem's
};

/// The states of a value and what becomes of them in a step.
struct SidesMarked {
  std::string below, above;  // "": no stage takes the value
  std::vector<Swap> swaps;
};

/// A step, or one that is tried where there is a tolerance, with states that say on which sides of 0 values were in its
/// stages: for each value two, in their order; none of what no stage is made of. Without a program where the scene has
/// no equations.
struct WatchedStep {
  Module module;
  std::vector<SidesMarked> marks;
};
WatchedStep watched_step(const model::Problem& problem, const std::string& name,
                         const std::vector<WatchedValue>& values);

}  // namespace dpde::stencil
