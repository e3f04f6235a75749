// SPDX-License-Identifier: Apache-2.0
// Converts formulas of the text to typed formulas of the model: resolves names, substitutes lets, and writes vector
// operators out over the axes of the scene. On one axis a number also counts as a vector.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "model/from_ast/elaboration.h"

namespace dpde::model {

/// Context of an expression, which determines its allowed contents.
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

/// Position of a formula in the text, and the names known there in addition to those of the scene.
struct FormulaScope {
  Elaboration& elaboration;
  FormulaContext context;
  std::string subject;                              // a field, a coefficient, ...: for messages
  const FunctionScope* function = nullptr;          // function whose body this is
  std::map<std::string, TypedExpr> variables = {};  // integration variables of formulas, with their values
  std::set<std::string> open = {};                  // names whose scene formulas are being substituted
  std::map<std::string, TypedExpr> put_in = {};     // and those already substituted
  std::vector<Expr> integrals = {};                 // expanded integrals of formulas
  bool is_measuring = false;                        // this body is read only to measure its order
  bool is_in_parts = false;                         // integrals of formulas are computed in two parts, for comparison
  bool is_in_average = false;                       // inside average(...)
  bool is_in_sum = false;                           // products of dot keep their own placements

  /// Whether it is a formula of a step.
  bool is_of_step() const { return context == FormulaContext::equation || context == FormulaContext::event; }
  int axis_count() const { return static_cast<int>(elaboration.problem.axes.size()); }
};

namespace formulas {

/// A formula of any type; `none` after a diagnostic.
TypedExpr any(FormulaScope& here, const ast::Expr& e);
/// A number or a vector; `none` after a diagnostic.
TypedExpr numeric(FormulaScope& here, const ast::Expr& e);
/// nullopt after a diagnostic, also if the expression is not a number or too large.
std::optional<Expr> number(FormulaScope& here, const ast::Expr& e);
std::optional<Expr> condition(FormulaScope& here, const ast::Expr& e);
/// The value given to the field or coefficient `name`: a number, or the components of a vector; 0 may stand for a
/// vector.
std::optional<std::vector<Expr>> components(FormulaScope& here, const ast::Expr& e, const std::string& name);
/// The right-hand side of an equation or a let; recorded as dropped if it is 0.
TypedExpr definition(FormulaScope& here, const ast::Expr& e);

// The same for a single formula.
inline TypedExpr numeric(FormulaScope&& here, const ast::Expr& e) { return numeric(here, e); }
inline std::optional<Expr> number(FormulaScope&& here, const ast::Expr& e) { return number(here, e); }
inline std::optional<Expr> condition(FormulaScope&& here, const ast::Expr& e) { return condition(here, e); }
inline std::optional<std::vector<Expr>> components(FormulaScope&& here, const ast::Expr& e, const std::string& name) {
  return components(here, e, name);
}
inline TypedExpr definition(FormulaScope&& here, const ast::Expr& e) { return definition(here, e); }

}  // namespace formulas

/// "an equation", "an initial state", ...
std::string_view place_of(FormulaContext context);

/// "vector of 2 components", "condition", ...
std::string describe(const TypedExpr& value);

// Numbers used at compile time, for the grid or another parameter: their parameters become fixed
// (ElaboratedParams::fixed).
/// The value of `e`, an expression of numbers and parameters with values; nullopt after a diagnostic. `what` is for
/// messages: "the step".
std::optional<double> evaluate(Elaboration& elaboration, const ast::Expr& e, const std::string& what);
/// The same for a formula of numbers, parameters and, if given, t.
std::optional<double> made_once(Elaboration& elaboration, const Expr& formula, SourceRange range,
                                std::optional<double> t = {});
/// Makes the parameters of a formula fixed.
void fix_params(Elaboration& elaboration, const Expr& formula);

bool is_load(const ast::Expr& e);
struct LoadedFile {
  std::string file, variable;
};
/// load("path") or load("path.nc", u); nullopt if `e` is not a call of load. An invalid one is reported and gives file
/// "".
std::optional<LoadedFile> file_of(Elaboration& elaboration, const ast::Expr& e);

/// Whether it is, or can be, a datum with one number per state: an observable of a scene, or a file used in such a
/// position. Fields of a scene and states of trajectories lie on its grid; without a grid they are numbers but not
/// series.
bool can_be_series(const Elaboration& elaboration, const std::string& field);
/// Marks such a datum as a series; false if `field` is not one.
bool mark_as_series(Elaboration& elaboration, const std::string& field);

/// In steps a point value is a uniform number like a mean: computed once, and equal in all cells of networks.
Expr with_points_as_numbers(const Problem& problem, const Expr& e);
/// Evaluates terms with samples outside of mean, sum and integral once, in the first cell of the grid.
Expr over_one_cell(Elaboration& elaboration, const Expr& e);

/// A formula, or load("path") with or without a variable, for each component of `subject`.
std::vector<Source> sources_of(Elaboration& elaboration, const ast::Expr& e, FormulaContext context,
                               const std::string& subject);

}  // namespace dpde::model
