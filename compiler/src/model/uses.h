// SPDX-License-Identifier: Apache-2.0
// What a problem reads: each of its formulas, with the place where it stands. Walks over a problem go through here, and
// choose by a switch without default: a kind of use that a walk leaves out is a line of it that says so.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "model/model.h"

namespace dpde::model {

/// Where a formula of a problem stands.
enum class UseKind {
  equation,         // dt(u) = ...
  potential,        // what a constraint solves for, behind each stage
  constraint,       // what is to be 0
  correction,       // the value of a state behind each stage
  held_where,       // the mask inside which a state is held
  held_value,       // its value there
  event,            // the value of a state behind a step
  courant_rate,     // into how many parts a step is split
  observable,       // a number of the states
  output,           // a field that a run writes
  loss,             // of the task
  test,             // of the task, a number
  test_field,       // of the task, what a spectrum or a correlation is of
  initial,          // the state that the run begins with
  coefficient,      // the field itself, a control field in the middle of each interval
  control,          // the value in each interval
  control_start,    // where a task begins that seeks it
  unknown_start,    // the same, of other unknowns
  exact,            // the solution that a run is compared with
  boundary_value,   // what a side of a state is given
  boundary_weight,  // a and b of a mixed condition
  stretch_map,      // where the points of an axis lie
  metric,           // the length of a unit of a coordinate
  stated_operator,  // the body of an operator whose order is stated: measured, never run
};

/// When formulas are evaluated. What holds of one of a group holds of all, or a walk asks for the kind.
enum class UseTime {
  step,      // in steps, of the states: whatever an equation may hold may stand there
  result,    // of states that were reached, the same
  field,     // before the run or between steps: fields and numbers of coordinates, parameters and t
  boundary,  // where sides are filled: of coordinates, parameters, t and values beside the wall
  geometry,  // once, of numbers and coordinates
  never,     // of what is measured by the compiler alone
};
UseTime time_of(UseKind kind);
/// In the step or of its results: derivatives, solves, networks and operators may stand there.
bool is_of_states(UseKind kind);
/// Whether the program of a step makes the state `owner` of it.
bool makes_state(UseKind kind);

struct Use {
  UseKind kind;
  const Expr& formula;
  Placement home;            // where the formula is taken; of numbers and what belongs to no field the centres
  const Origin& origin;      // of the line that it stands in
  const std::string& owner;  // the state, coefficient, observable, ... whose it is; of the scene's own its name
};

/// Equations first, those of all states; then what else steps do; then results; then all others.
void for_each_formula(const Problem& problem, const std::function<void(const Use&)>& f);
/// Whether `f` is true of a formula.
bool any_formula(const Problem& problem, const std::function<bool(const Use&)>& f);

/// In the place of each formula what `f` makes of it.
void rewrite_formulas(Problem& problem, const std::function<Expr(const Use&)>& f);

}  // namespace dpde::model
