// SPDX-License-Identifier: Apache-2.0
// Switches in a run that depend on unknowns of a task or on states. The derivative ignores that a switch moves: it is
// right if the branches meet there; otherwise it lacks the jump.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "model/analyse/influence.h"
#include "model/model.h"
#include "support/maths/piecewise.h"

namespace dpde::model {

/// An unknown that changes the losses though its derivative is 0 almost everywhere.
struct OnlySwitching {
  std::size_t unknown;  // index in the task
  Origin origin;        // of a switch that depends on it; not known if it determines the length of steps
  std::string what;     // "floor"; "" for if
  bool sets_length = false;
};
std::vector<OnlySwitching> only_switching(const Problem& problem, const Influence& influence);

/// Location of a formula: a loss of the task, the equation of a state, an event after each step, or another event of
/// the problem. If all are empty: elsewhere.
struct FormulaPlace {
  std::optional<std::size_t> loss = {};
  std::string equation = {};
  bool is_in_each_step = false;
  std::optional<std::size_t> event = {};
};

/// A switch at which a value jumps, or a division by 0.
struct Jump {
  Origin origin;
  std::string what;                 // "sign", "floor"; "" for if
  std::vector<std::string> movers;  // states, coefficients and parameters on which the switch depends
  std::string within;               // operator or moving mask in whose body it is; else ""
  bool is_at_pole = false;          // a division by 0
  /// Positive on one side of the switch, negative on the other. nullopt if it cannot be expressed in the problem's
  /// names, or if both signs occur at the start, unless it belongs to a later event.
  std::optional<Expr> side = {};
  FormulaPlace in = {};
};
/// Signs of fields in divisors. kept: fields keep the signs that formulas are written for; any: a run may give any
/// sign.
enum class Signs { kept, any };
/// Jumps of all formulas that the losses depend on. Formulas of masks are skipped, as they must not contain unknowns.
std::vector<Jump> jumps_of(const Problem& problem, const Influence& influence, Signs signs);

/// A divisor, or a factor of one, at whose zeros a formula jumps. The formula counts as differentiable as long as
/// fields keep their signs (Signs::kept).
struct Divisor {
  std::optional<Expr> value;  // of the scene's names; nullopt if it needs others, as in solves, or does not change sign
  Origin origin;              // of the quotient
  /// For fields given by formulas: the text guarantees one sign, or an unknown moves the zeros.
  bool begins_with_one_sign = false;
  FormulaPlace in = {};
};
/// Of all formulas that the losses depend on, without those that jump anyway.
std::vector<Divisor> trusted_divisors(const Problem& problem, const Influence& influence);

/// The symbol for a parameter, t or dt, with its range. An unknown parameter stays within its bounds. Without bounds it
/// is assumed to keep its sign, as a length or rate does, even where other quantities change.
Piecewise::Symbol range_of(const Problem& problem, const std::string& param);

/// Which fields, parameters and networks change, and whether positions do.
struct Movement {
  std::function<bool(const std::string&)> moves;
  bool places = false;
  Signs signs = Signs::kept;
};
std::optional<Jump> jump_in(const Expr& formula, const Problem& problem, const Movement& movement);

}  // namespace dpde::model
