// SPDX-License-Identifier: Apache-2.0
// Formulas of the text become typed formulas of the model: names are resolved, lets put in, vector operators spelled
// out over the axes of the scene. On one axis a number is a vector as well.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "model/from_ast/elaboration.h"

namespace dpde::model {

/// Where an expression stands; this decides what it may be made of.
enum class FormulaContext {
  equation,
  event,
  initial,
  coefficient,
  control_field,
  mask,
  exact,
  boundary,
  boundary_weight,
  control,
  number,
  stretch,
  scale,
  quantity
};

/// Where a formula stands in the text, and the names that are known there beside those of the scene.
struct FormulaScope {
  Elaboration& elaboration;
  FormulaContext context;
  std::string subject;                              // a field, a coefficient, ...: for messages
  const FunctionScope* function = nullptr;          // whose body this is
  std::map<std::string, TypedExpr> variables = {};  // of integrals of formulas, and their values
  std::set<std::string> open = {};                  // names whose formulas of the scene are being put in
  std::map<std::string, TypedExpr> put_in = {};     // and those that were
  std::vector<Expr> integrals = {};                 // of formulas, spelled out
  bool is_measuring = false;                        // this body is read for its order only
  bool is_in_parts = false;                         // integrals of formulas are taken in two parts, to compare
  bool is_in_average = false;                       // whose mean over the states is taken
  bool is_in_sum = false;                           // products of dot are left where they lie

  /// In the formulas that a step consists of.
  bool is_of_step() const { return context == FormulaContext::equation || context == FormulaContext::event; }
  int axis_count() const { return static_cast<int>(elaboration.problem.axes.size()); }
};

namespace formulas {

/// A formula of any type; none after a diagnostic.
TypedExpr any(FormulaScope& here, const ast::Expr& e);
/// A number or a vector; none after a diagnostic.
TypedExpr numeric(FormulaScope& here, const ast::Expr& e);
/// nullopt after a diagnostic, also when the expression is no number or grows too large.
std::optional<Expr> number(FormulaScope& here, const ast::Expr& e);
std::optional<Expr> condition(FormulaScope& here, const ast::Expr& e);
/// The value given to the field or coefficient `name`: a number, or of a vector its components; 0 is a vector too.
std::optional<std::vector<Expr>> components(FormulaScope& here, const ast::Expr& e, const std::string& name);
/// The right-hand side of an equation or a let, noted as dropped when it is 0 in the end.
TypedExpr definition(FormulaScope& here, const ast::Expr& e);

// The same of one formula.
inline TypedExpr numeric(FormulaScope&& here, const ast::Expr& e) { return numeric(here, e); }
inline std::optional<Expr> number(FormulaScope&& here, const ast::Expr& e) { return number(here, e); }
inline std::optional<Expr> condition(FormulaScope&& here, const ast::Expr& e) { return condition(here, e); }
inline std::optional<std::vector<Expr>> components(FormulaScope&& here, const ast::Expr& e, const std::string& name) {
  return components(here, e, name);
}
inline TypedExpr definition(FormulaScope&& here, const ast::Expr& e) { return definition(here, e); }

}  // namespace formulas

/// "an equation", "an initial state", ...
std::string_view place_of(FormulaContext purpose);

/// "vector of 2 components", "condition", ...
std::string describe(const TypedExpr& value);

// Numbers of which something is made here and not again, as the grid or another parameter: from then on the parameters
// in them are fixed (ElaboratedParams::fixed).
/// The number that `e` means, made of numbers and parameters that have values; nullopt after a diagnostic. `what` is
/// for messages: "the step".
std::optional<double> evaluate(Elaboration& elaboration, const ast::Expr& e, const std::string& what);
/// The same of a formula of numbers, parameters and, where it is given, t.
std::optional<double> made_once(Elaboration& elaboration, const Expr& formula, SourceRange range,
                                std::optional<double> t = {});
/// A formula that is made once of the parameters' values.
void fix_params(Elaboration& elaboration, const Expr& formula);

bool is_load(const ast::Expr& e);
struct LoadedFile {
  std::string file, variable;
};
/// load("path") or load("path.nc", u); nullopt when `e` is no call of load. A bad one is reported and gives a file "".
std::optional<LoadedFile> file_of(Elaboration& elaboration, const ast::Expr& e);

/// Whether it is a datum that is one number a state, or can be: an observable of a scene, or a file, of which it is
/// said by where it stands. Fields of a scene and states of trajectories lie on its grid; without a grid they are
/// numbers without being that.
bool can_be_series(const Elaboration& elaboration, const std::string& field);
/// Marks such a datum as one number a state; false when `field` is none.
bool mark_as_series(Elaboration& elaboration, const std::string& field);

/// In steps a value at a point is a number, as a mean is: known once, and in networks the same in all cells.
Expr with_points_as_numbers(const Problem& problem, const Expr& e);
/// Terms that hold samples outside of mean, sum and integral, taken once: in the first cell of the grid.
Expr over_one_cell(Elaboration& elaboration, const Expr& e);

/// A formula, or load("path") with or without a variable, for each component of `subject`.
std::vector<Source> sources_of(Elaboration& elaboration, const ast::Expr& e, FormulaContext purpose,
                               const std::string& subject);

}  // namespace dpde::model
