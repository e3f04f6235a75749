// SPDX-License-Identifier: Apache-2.0
// All formulas of a problem, each with the kind of its use. Every traversal of a problem goes through here and chooses
// by a switch without default, so a traversal that skips a kind has a line that says so.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "model/model.h"

namespace dpde::model {

/// Role of a formula in a problem.
enum class UseKind {
  equation,         // dt(u) = ...
  potential,        // the solve of a constraint, after each stage
  constraint,       // has to be 0
  correction,       // the value of a state after each stage
  held_where,       // mask inside which a state is fixed
  held_value,       // its value there
  event,            // the value of a state after a step
  courant_rate,     // number of substeps of a step
  observable,       // a number computed from the states
  output,           // a field that a run writes
  loss,             // of the task
  test,             // a number of the task
  test_field,       // of the task: field of a spectrum or a correlation
  initial,          // the initial state
  coefficient,      // the field itself; of a control field, in the middle of each interval
  control,          // the value in each interval
  control_start,    // initial value of an unknown control
  unknown_start,    // initial value of other unknowns
  exact,            // the exact solution for comparison
  boundary_value,   // value of a boundary condition
  boundary_weight,  // a and b of a mixed condition
  stretch_map,      // positions of the points of an axis
  metric,           // length of a unit of a coordinate
  stated_operator,  // body of an operator with a declared order: only measured, never run
};

/// When formulas are evaluated. All kinds of a group are treated alike, or a traversal asks for the kind itself.
enum class UseTime {
  step,      // in steps, from the states: everything allowed in an equation is allowed here
  result,    // from the computed states; same rules
  field,     // before the run or between steps: fields and numbers of coordinates, parameters and t
  boundary,  // at sides: of coordinates, parameters, t and values next to the wall
  geometry,  // once, of numbers and coordinates
  never,     // formulas that only the compiler measures
};
UseTime time_of(UseKind kind);
/// Whether the formula is part of a step or of its results; it may then contain derivatives, solves, networks and
/// operators.
bool is_of_states(UseKind kind);
/// Whether the step computes state `owner` from the formula.
bool makes_state(UseKind kind);

struct Use {
  UseKind kind;
  const Expr& formula;
  Placement home;            // of the formula; cell centres for numbers and formulas without a field
  const Origin& origin;      // of its line
  const std::string& owner;  // its state, coefficient, observable, ...; for formulas of the scene its name
};

/// Order: equations of all states, other formulas of steps, results, all others.
void for_each_formula(const Problem& problem, const std::function<void(const Use&)>& f);
/// Whether `f` is true for at least one formula.
bool any_formula(const Problem& problem, const std::function<bool(const Use&)>& f);

/// Replaces each formula by the result of `f`.
void rewrite_formulas(Problem& problem, const std::function<Expr(const Use&)>& f);

}  // namespace dpde::model
