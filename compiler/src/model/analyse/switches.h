// SPDX-License-Identifier: Apache-2.0
// Where a run switches by what a task seeks, or by states that depend on it. A derivative knows nothing of how a switch
// moves: it is right where the branches meet, and lacks the jump where they do not.
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

/// An unknown whose derivative is 0 almost everywhere though the losses change with it.
struct OnlySwitching {
  std::size_t unknown;  // its place in the task
  Origin origin;        // of a switch that it moves; unknown where it sets how long steps are
  std::string what;     // "floor"; "" for if
  bool sets_length = false;
};
std::vector<OnlySwitching> only_switching(const Problem& problem, const Influence& influence);

/// Where a formula stands: of the task's losses in which, in the equation of which state, in an event of each step, or
/// of the problem's other events in which. None of them: elsewhere.
struct FormulaPlace {
  std::optional<std::size_t> loss = {};
  std::string equation = {};
  bool is_in_each_step = false;
  std::optional<std::size_t> event = {};
};

/// A choice whose value jumps where it switches, or what jumps where it divides by 0.
struct Jump {
  Origin origin;
  std::string what;                 // "sign", "floor"; "" for if
  std::vector<std::string> movers;  // states, coefficients and parameters that move the switch
  std::string within;               // the operator or moving mask in whose body it stands; "" else
  bool is_at_pole = false;          // where something is divided by 0
  /// Positive on one side of the switch and negative on the other; nullopt where the problem's names do not say it, and
  /// where the run begins on both sides, unless it is of an event that happens later.
  std::optional<Expr> side = {};
  FormulaPlace in = {};
};
/// Of fields that something is divided by: kept, as formulas are written for, or whatever a run makes of them.
enum class Signs { kept, any };
/// Of each formula that the losses hang on. Those of masks are left out, as no unknown may stand in them.
std::vector<Jump> jumps_of(const Problem& problem, const Influence& influence, Signs signs);

/// What a formula divides by, or a factor of it, where the formula jumps at 0 and is taken for differentiable as fields
/// keep their signs (Signs::kept).
struct Divisor {
  std::optional<Expr> value;  // of the scene's fields and parameters; nullopt where it is made of others, as in solves,
                              // and where it is 0 without a change of sign
  Origin origin;              // of the quotient
  /// Wherever its fields are given by formulas: the text promises it, or an unknown moves the places where it is 0.
  bool begins_with_one_sign = false;
  FormulaPlace in = {};
};
/// Of the formulas that the losses hang on; those that jump all the same are left out.
std::vector<Divisor> trusted_divisors(const Problem& problem, const Influence& influence);

/// The value of a parameter, of t or of dt, and where it may go: a sought parameter stays within its bounds. Without
/// bounds it keeps its sign, as a length or a rate does, for which formulas are written, where other things move too.
Piecewise::Symbol range_of(const Problem& problem, const std::string& param);

/// Fields, parameters and networks that move, and whether places do.
struct Movement {
  std::function<bool(const std::string&)> moves;
  bool places = false;
  Signs signs = Signs::kept;
};
std::optional<Jump> jump_in(const Expr& formula, const Problem& problem, const Movement& movement);

}  // namespace dpde::model
