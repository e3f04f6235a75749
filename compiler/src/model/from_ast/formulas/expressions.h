// SPDX-License-Identifier: Apache-2.0
// Expressions of the ast to typed expressions of the model: names resolved, lets put in, vector operators spelled out
// over the axes of the scene. On one axis a number is a vector as well.
#pragma once

#include <functional>
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

class Expressions {
 public:
  /// `subject` is what the expression belongs to, for messages: a field, a coefficient, ...
  Expressions(Elaboration& elaboration, FormulaContext purpose, std::string subject)
      : elaboration_(elaboration), purpose_(purpose), subject_(std::move(subject)) {}

  TypedExpr any(const ast::Expr& e);
  /// A number or a vector; none after a diagnostic.
  TypedExpr numeric(const ast::Expr& e);
  /// nullopt after a diagnostic, also when the expression is no number or grows too large.
  std::optional<Expr> number(const ast::Expr& e);
  std::optional<Expr> condition(const ast::Expr& e);
  /// What is given to the field or coefficient `name`: a number, or of a vector its components; 0 is a vector too.
  std::optional<std::vector<Expr>> components(const ast::Expr& e, const std::string& name);
  /// The right-hand side of an equation or a let, noted as dropped when it is 0 in the end.
  TypedExpr definition(const ast::Expr& e);

  /// Names and functions that are known here.
  static std::vector<std::string> function_names();
  static bool is_built_in(const std::string& function);

 private:
  struct Operand {
    const ast::Expr& source;
    TypedExpr value;
  };

  TypedExpr name(const ast::Name& e, SourceRange range);
  /// Whether it is an unknown of the task that is no initial state.
  bool is_sought(const std::string& name) const;
  bool is_known_at_walls(const Symbol& meaning, const std::string& name) const;
  TypedExpr parameter(const std::string& name, SourceRange range);
  // scene_names.cpp
  TypedExpr scene_let(const std::string& name, SourceRange range);
  /// The formula that the scene gives a state or coefficient.
  TypedExpr given(const std::string& name, const Symbol& meaning, SourceRange range);
  TypedExpr put_in(const std::string& name, SourceRange range, const std::function<TypedExpr()>& formula);
  TypedExpr unary(const ast::Unary& e, SourceRange range);
  TypedExpr chain(const ast::Expr& e);
  TypedExpr combine(BinaryOp op, const Operand& left, const Operand& right, SourceRange range);
  TypedExpr arithmetic(BinaryOp op, const Operand& left, const Operand& right, SourceRange range);
  TypedExpr scalar_operation(BinaryOp op, const Operand& left, const Operand& right, SourceRange range);
  TypedExpr tuple(const ast::Tuple& e);
  // functions.cpp: those of the file
  TypedExpr user_call(const ast::Function& function, const ast::Call& e, SourceRange range);
  TypedExpr body(FunctionScope& scope, const ast::Call& e, SourceRange range);
  void note_order(const FunctionScope& call, const TypedExpr& value);
  // operators.cpp: those whose adjoint is given
  TypedExpr application(const FunctionScope& call, const ast::Call& e, SourceRange range);
  bool can_apply(const FunctionScope& call, const ast::Call& e, SourceRange range);
  bool can_pass(const TypedExpr& argument, SourceRange at, const std::string& what);
  TypedExpr formula_of_parameters(const FunctionScope& call, const ast::Expr& e, const TypedExpr* seed);
  bool add_adjoint(const FunctionScope& call, const ast::AdjointItem& item, const TypedExpr& seed, Operator& function);
  bool can_take_adjoints(const FunctionScope& call, const Apply& application, SourceRange range);
  bool lay_out(Apply& result, SourceRange range);
  TypedExpr name_in_function(const std::string& name, SourceRange range);
  TypedExpr offsets(const ast::Offsets& e, SourceRange range);
  TypedExpr vector(const std::string& name, SourceRange range);
  TypedExpr component(const ast::Identifier& name);
  TypedExpr component(const ast::Component& e, SourceRange range);

  // calls.cpp
  TypedExpr call(const ast::Call& e, SourceRange range);
  TypedExpr unknown_call(const ast::Call& e);
  TypedExpr rate(const ast::Call& e, SourceRange range);
  TypedExpr elementary(Fn fn, const ast::Call& e, SourceRange range);
  TypedExpr choice(const ast::Call& e, SourceRange range);
  TypedExpr along(int axis, const ast::Call& e, SourceRange range);
  TypedExpr along_named_axis(const ast::Call& e, SourceRange range);
  std::optional<int> order_of(const ast::Expr& e);
  TypedExpr laplacian(const ast::Call& e, SourceRange range);
  bool can_take_vector_laplacian(const TypedExpr& operand, SourceRange range);
  TypedExpr gradient(const ast::Call& e, SourceRange range);
  TypedExpr divergence(const ast::Call& e, SourceRange range);
  TypedExpr advection(const ast::Call& e, SourceRange range);
  TypedExpr cross_product(const ast::Call& e, SourceRange range);
  TypedExpr poisson_bracket(const ast::Call& e, SourceRange range);
  TypedExpr curl(const ast::Call& e, SourceRange range);
  TypedExpr magnitude(const ast::Expr& operand, SourceRange range);
  TypedExpr norm(const TypedExpr& value, SourceRange range);
  TypedExpr interpolation(const ast::Call& e, SourceRange range);
  TypedExpr band(const ast::Call& e, SourceRange range);
  std::optional<int> shell_of(const ast::Expr& e, int least);

  // tensors.cpp
  bool is_tensor(const TypedExpr& value) const;
  TypedExpr identity() const;
  TypedExpr rows(const ast::Tuple& e);
  /// outer, inner, sym, transpose, trace; nullopt of other calls.
  std::optional<TypedExpr> tensor_call(const ast::Call& e, SourceRange range);
  TypedExpr outer_product(const ast::Call& e, SourceRange range);
  TypedExpr inner_product(const ast::Call& e, SourceRange range);
  TypedExpr scalar_product(const std::vector<Expr>& a, const std::vector<Expr>& b, SourceRange range);
  TypedExpr dot_product(const ast::Call& e, SourceRange range);
  /// Warns where the operand of an operator holds derivatives, up to `allowed` inside one another.
  void look_beside_poles(const std::vector<Expr>& operand, int allowed, SourceRange range);
  bool can_take_tensor(const std::string& what, SourceRange range);
  TypedExpr vector_gradient(const std::vector<Expr>& v, SourceRange range);
  TypedExpr tensor_divergence(const std::vector<Expr>& s, SourceRange range);
  std::optional<Expr> tensor_component(const TypedExpr& whole, const ast::Identifier& part);

  // forces.cpp
  std::vector<Expr> rates_inside(const ast::Call& e, SourceRange range);
  TypedExpr force(const ast::Call& e, SourceRange range);
  TypedExpr torque(const ast::Call& e, SourceRange range);

  // wall_integrals.cpp
  /// The argument at = y.low, or null.
  static const ast::Argument* wall_of(const ast::Call& e);
  TypedExpr wall_reduction(Reduce::Kind kind, const ast::Call& e, SourceRange range);

  // inferences.cpp
  bool may_call_network(const DeclaredNetwork& declared, const ast::Call& e);
  bool may_mix_places(const DeclaredNetwork& declared, const NetworkCall& call, SourceRange range);
  TypedExpr inference(const DeclaredNetwork& declared, const ast::Call& e, const ast::Identifier* output,
                      SourceRange range);
  std::optional<std::vector<Expr>> counted_channels(const network::Network& network, const ast::Call& e);
  std::optional<std::vector<Expr>> channels(const DeclaredNetwork& declared, const ast::Call& e);

  // reductions.cpp
  /// mean, sum, integral, and max and min of one argument: over space.
  static std::optional<Reduce::Kind> reduction_called(const ast::Call& e);
  TypedExpr reduction(Reduce::Kind kind, const ast::Call& e, SourceRange range);
  /// Its terms, each at a place of its own.
  std::vector<Expr> terms_of_reduction(Reduce::Kind kind, const ast::Expr& operand);
  std::optional<std::array<bool, 3>> axes_of_reduction(const ast::Call& e);
  /// Marks the axis that `e` names.
  bool add_axis(const ast::Expr& e, std::array<bool, 3>& over);

  // averages.cpp
  /// The mean over the states that a loss looks at: a number that stands for it.
  TypedExpr average(const ast::Call& e, SourceRange range);

  // quadrature.cpp
  static bool is_quadrature(const ast::Call& e);
  bool follows_place(const ast::Call& e);
  std::optional<Expr> gauss_sum(const ast::Call& e, const Expr& low, const Expr& high, bool of_sizes);
  void look_at_parts(const ast::Call& e, const Expr& low, const Expr& high, const Expr& whole);
  std::optional<Expr> sum_of_parts(const ast::Call& e, const Expr& low, const Expr& high);
  TypedExpr quadrature(const ast::Call& e, SourceRange range);

  // random.cpp
  struct Spectrum {
    double seed = 0, lowest = 1, highest = 1, slope = 0;
  };
  std::optional<Spectrum> spectrum(const ast::Call& e);
  TypedExpr random_waves(const ast::Call& e, SourceRange range);
  TypedExpr white_noise(const ast::Call& e, SourceRange range);

  // points.cpp
  TypedExpr sampling(const ast::Call& e, SourceRange range);
  TypedExpr injection(const ast::Call& e, SourceRange range);
  /// The place of a call f(..., at = place): one number an axis, the same at all points, within the grid where it is
  /// known.
  std::optional<std::vector<Expr>> point(const ast::Call& e);

  /// Whether the call has `count` arguments, all without names.
  bool takes(const ast::Call& e, int count);
  bool has_axis(int axis, SourceRange range);

  std::optional<Expr> as_number(const TypedExpr& value, SourceRange range);
  /// One component an axis.
  std::optional<std::vector<Expr>> as_vector(const TypedExpr& value, SourceRange range);
  bool is_too_large(const TypedExpr& value, SourceRange range);
  TypedExpr refuse(const std::string& what, SourceRange range, const std::string& name = "");

  /// Notes that a term is 0, unless it was written so or is a sum, whose terms were noted one by one. `begin`: how many
  /// were dropped before it; what was noted inside of it since then goes with it.
  void note_if_dropped(const Operand& term, std::size_t begin);
  std::string reason_for_zero(const ast::Expr& e);

  /// In what steps are made of.
  bool is_of_step() const { return purpose_ == FormulaContext::equation || purpose_ == FormulaContext::event; }
  int axis_count() const { return static_cast<int>(elaboration_.problem.axes.size()); }

  Elaboration& elaboration_;
  FormulaContext purpose_;
  std::string subject_;
  const FunctionScope* function_ = nullptr;        // whose body this is
  std::map<std::string, TypedExpr> running_ = {};  // what stands for the variables of integrals of formulas
  std::set<std::string> open_ = {};                // names whose formulas of the scene are being put in
  std::map<std::string, TypedExpr> put_in_ = {};   // and those that were
  std::vector<Expr> integrals_ = {};               // of formulas, spelled out
  bool is_measuring_ = false;                      // this body is read for its order only
  bool is_in_parts_ = false;                       // integrals of formulas are taken in two parts, to compare
  bool is_in_average_ = false;                     // whose mean over the states is taken
  bool is_in_sum_ = false;                         // products of dot are left where they lie
};

/// "an equation", "an initial state", ...
std::string_view place_of(FormulaContext purpose);

/// "vector of 2 components", "condition", ...
std::string describe(const TypedExpr& value);

// Numbers of which something is made here and not again, as the grid or another parameter: from then on the parameters
// in them are fixed (Elaboration::fixed).
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
