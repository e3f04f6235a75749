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

#include "model/from_ast/draft.h"

namespace dpde::model {

/// Where an expression stands; this decides what it may be made of.
enum class Purpose {
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
  Expressions(Draft& draft, Purpose purpose, std::string subject)
      : draft_(draft), purpose_(purpose), subject_(std::move(subject)) {}

  Typed any(const ast::Expr& e);
  /// A number or a vector; none after a diagnostic.
  Typed numeric(const ast::Expr& e);
  /// nullopt after a diagnostic, also when the expression is no number or grows too large.
  std::optional<Expr> number(const ast::Expr& e);
  std::optional<Expr> condition(const ast::Expr& e);
  /// What is given to the field or coefficient `name`: a number, or of a vector its components; 0 is a vector too.
  std::optional<std::vector<Expr>> components(const ast::Expr& e, const std::string& name);
  /// The right-hand side of an equation or a let, noted as dropped when it is 0 in the end.
  Typed definition(const ast::Expr& e);

  /// Names and functions that are known here.
  static std::vector<std::string> function_names();
  static bool is_built_in(const std::string& function);

 private:
  struct Operand {
    const ast::Expr& source;
    Typed value;
  };

  Typed name(const ast::Name& e, SourceRange range);
  /// Whether it is an unknown of the task that is no initial state.
  bool is_sought(const std::string& name) const;
  bool is_known_at_walls(const Meaning& meaning, const std::string& name) const;
  Typed parameter(const std::string& name, SourceRange range);
  // scene_names.cpp
  Typed scene_let(const std::string& name, SourceRange range);
  /// The formula that the scene gives a state or coefficient.
  Typed given(const std::string& name, const Meaning& meaning, SourceRange range);
  Typed put_in(const std::string& name, SourceRange range, const std::function<Typed()>& formula);
  Typed unary(const ast::Unary& e, SourceRange range);
  Typed chain(const ast::Expr& e);
  Typed combine(BinaryOp op, const Operand& left, const Operand& right, SourceRange range);
  Typed arithmetic(BinaryOp op, const Operand& left, const Operand& right, SourceRange range);
  Typed scalar_operation(BinaryOp op, const Operand& left, const Operand& right, SourceRange range);
  Typed tuple(const ast::Tuple& e);
  // functions.cpp: those of the file
  Typed user_call(const ast::Function& function, const ast::Call& e, SourceRange range);
  Typed body(FunctionScope& scope, const ast::Call& e, SourceRange range);
  void note_order(const FunctionScope& call, const Typed& value);
  // operators.cpp: those whose adjoint is given
  Typed application(const FunctionScope& call, const ast::Call& e, SourceRange range);
  bool can_apply(const FunctionScope& call, const ast::Call& e, SourceRange range);
  bool can_pass(const Typed& argument, SourceRange at, const std::string& what);
  Typed formula_of_parameters(const FunctionScope& call, const ast::Expr& e, const Typed* seed);
  bool add_adjoint(const FunctionScope& call, const ast::AdjointItem& item, const Typed& seed, Operator& function);
  bool can_take_adjoints(const FunctionScope& call, const Apply& application, SourceRange range);
  bool lay_out(Apply& result, SourceRange range);
  Typed name_in_function(const std::string& name, SourceRange range);
  Typed offsets(const ast::Offsets& e, SourceRange range);
  Typed vector(const std::string& name, SourceRange range);
  Typed component(const ast::Identifier& name);
  Typed component(const ast::Component& e, SourceRange range);

  // calls.cpp
  Typed call(const ast::Call& e, SourceRange range);
  Typed unknown_call(const ast::Call& e);
  Typed rate(const ast::Call& e, SourceRange range);
  Typed elementary(Fn fn, const ast::Call& e, SourceRange range);
  Typed choice(const ast::Call& e, SourceRange range);
  Typed along(int axis, const ast::Call& e, SourceRange range);
  Typed along_named_axis(const ast::Call& e, SourceRange range);
  std::optional<int> order_of(const ast::Expr& e);
  Typed laplacian(const ast::Call& e, SourceRange range);
  bool can_take_vector_laplacian(const Typed& operand, SourceRange range);
  Typed gradient(const ast::Call& e, SourceRange range);
  Typed divergence(const ast::Call& e, SourceRange range);
  Typed advection(const ast::Call& e, SourceRange range);
  Typed cross_product(const ast::Call& e, SourceRange range);
  Typed poisson_bracket(const ast::Call& e, SourceRange range);
  Typed curl(const ast::Call& e, SourceRange range);
  Typed magnitude(const ast::Expr& operand, SourceRange range);
  Typed norm(const Typed& value, SourceRange range);
  Typed interpolation(const ast::Call& e, SourceRange range);
  Typed band(const ast::Call& e, SourceRange range);
  std::optional<int> shell_of(const ast::Expr& e, int least);

  // tensors.cpp
  bool is_tensor(const Typed& value) const;
  Typed identity() const;
  Typed rows(const ast::Tuple& e);
  /// outer, inner, sym, transpose, trace; nullopt of other calls.
  std::optional<Typed> tensor_call(const ast::Call& e, SourceRange range);
  Typed outer_product(const ast::Call& e, SourceRange range);
  Typed inner_product(const ast::Call& e, SourceRange range);
  Typed scalar_product(const std::vector<Expr>& a, const std::vector<Expr>& b, SourceRange range);
  Typed dot_product(const ast::Call& e, SourceRange range);
  /// Warns where the operand of an operator holds derivatives, up to `allowed` inside one another.
  void look_beside_poles(const std::vector<Expr>& operand, int allowed, SourceRange range);
  bool can_take_tensor(const std::string& what, SourceRange range);
  Typed vector_gradient(const std::vector<Expr>& v, SourceRange range);
  Typed tensor_divergence(const std::vector<Expr>& s, SourceRange range);
  std::optional<Expr> tensor_component(const Typed& whole, const ast::Identifier& part);

  // forces.cpp
  std::vector<Expr> rates_inside(const ast::Call& e, SourceRange range);
  Typed force(const ast::Call& e, SourceRange range);
  Typed torque(const ast::Call& e, SourceRange range);

  // wall_integrals.cpp
  /// The argument at = y.low, or null.
  static const ast::Argument* wall_of(const ast::Call& e);
  Typed wall_reduction(Reduce::Kind kind, const ast::Call& e, SourceRange range);

  // inferences.cpp
  bool may_call_network(const DeclaredNetwork& declared, const ast::Call& e);
  bool may_mix_places(const DeclaredNetwork& declared, const NetworkCall& call, SourceRange range);
  Typed inference(const DeclaredNetwork& declared, const ast::Call& e, const ast::Identifier* output,
                  SourceRange range);
  std::optional<std::vector<Expr>> counted_channels(const network::Network& network, const ast::Call& e);
  std::optional<std::vector<Expr>> channels(const DeclaredNetwork& declared, const ast::Call& e);

  // reductions.cpp
  /// mean, sum, integral, and max and min of one argument: over space.
  static std::optional<Reduce::Kind> reduction_called(const ast::Call& e);
  Typed reduction(Reduce::Kind kind, const ast::Call& e, SourceRange range);
  /// Its terms, each at a place of its own.
  std::vector<Expr> terms_of_reduction(Reduce::Kind kind, const ast::Expr& operand);
  std::optional<std::array<bool, 3>> axes_of_reduction(const ast::Call& e);
  /// Marks the axis that `e` names.
  bool add_axis(const ast::Expr& e, std::array<bool, 3>& over);

  // averages.cpp
  /// The mean over the states that a loss looks at: a number that stands for it.
  Typed average(const ast::Call& e, SourceRange range);

  // quadrature.cpp
  static bool is_quadrature(const ast::Call& e);
  bool follows_place(const ast::Call& e);
  std::optional<Expr> gauss_sum(const ast::Call& e, const Expr& low, const Expr& high, bool of_sizes);
  void look_at_parts(const ast::Call& e, const Expr& low, const Expr& high, const Expr& whole);
  std::optional<Expr> sum_of_parts(const ast::Call& e, const Expr& low, const Expr& high);
  Typed quadrature(const ast::Call& e, SourceRange range);

  // random.cpp
  struct Spectrum {
    double seed = 0, lowest = 1, highest = 1, slope = 0;
  };
  std::optional<Spectrum> spectrum(const ast::Call& e);
  Typed random_waves(const ast::Call& e, SourceRange range);
  Typed white_noise(const ast::Call& e, SourceRange range);

  // points.cpp
  Typed sampling(const ast::Call& e, SourceRange range);
  Typed injection(const ast::Call& e, SourceRange range);
  /// The place of a call f(..., at = place): one number an axis, the same at all points, within the grid where it is
  /// known.
  std::optional<std::vector<Expr>> point(const ast::Call& e);

  /// Whether the call has `count` arguments, all without names.
  bool takes(const ast::Call& e, int count);
  bool has_axis(int axis, SourceRange range);

  std::optional<Expr> as_number(const Typed& value, SourceRange range);
  /// One component an axis.
  std::optional<std::vector<Expr>> as_vector(const Typed& value, SourceRange range);
  bool is_too_large(const Typed& value, SourceRange range);
  Typed refuse(const std::string& what, SourceRange range, const std::string& name = "");

  /// Notes that a term is 0, unless it was written so or is a sum, whose terms were noted one by one. `begin`: how many
  /// were dropped before it; what was noted inside of it since then goes with it.
  void note_if_dropped(const Operand& term, std::size_t begin);
  std::string reason_for_zero(const ast::Expr& e);

  /// In what steps are made of.
  bool is_of_step() const { return purpose_ == Purpose::equation || purpose_ == Purpose::event; }
  int axis_count() const { return static_cast<int>(draft_.problem.axes.size()); }

  Draft& draft_;
  Purpose purpose_;
  std::string subject_;
  const FunctionScope* function_ = nullptr;    // whose body this is
  std::map<std::string, Typed> running_ = {};  // what stands for the variables of integrals of formulas
  std::set<std::string> open_ = {};            // names whose formulas of the scene are being put in
  std::map<std::string, Typed> put_in_ = {};   // and those that were
  std::vector<Expr> integrals_ = {};           // of formulas, spelled out
  bool is_measuring_ = false;                  // this body is read for its order only
  bool is_in_parts_ = false;                   // integrals of formulas are taken in two parts, to compare
  bool is_in_average_ = false;                 // whose mean over the states is taken
  bool is_in_sum_ = false;                     // products of dot are left where they lie
};

/// "an equation", "an initial state", ...
std::string_view place_of(Purpose purpose);

/// "vector of 2 components", "condition", ...
std::string describe(const Typed& value);

// Numbers of which something is made here and not again, as the grid or another parameter: from then on the parameters
// in them are fixed (Draft::fixed).
/// The number that `e` means, made of numbers and parameters that have values; nullopt after a diagnostic. `what` is
/// for messages: "the step".
std::optional<double> evaluate(Draft& draft, const ast::Expr& e, const std::string& what);
/// The same of a formula of numbers, parameters and, where it is given, t.
std::optional<double> made_once(Draft& draft, const Expr& formula, SourceRange range, std::optional<double> t = {});
/// A formula that is made once of the parameters' values.
void fix_params(Draft& draft, const Expr& formula);

bool is_load(const ast::Expr& e);
struct LoadedFile {
  std::string file, variable;
};
/// load("path") or load("path.nc", u); nullopt when `e` is no call of load. A bad one is reported and gives a file "".
std::optional<LoadedFile> file_of(Draft& draft, const ast::Expr& e);

/// Whether it is a datum that is one number a state, or can be: an observable of a scene, or a file, of which it is
/// said by where it stands. Fields of a scene and states of trajectories lie on its grid; without a grid they are
/// numbers without being that.
bool can_be_series(const Draft& draft, const std::string& field);
/// Marks such a datum as one number a state; false when `field` is none.
bool mark_as_series(Draft& draft, const std::string& field);

/// In steps a value at a point is a number, as a mean is: known once, and in networks the same in all cells.
Expr with_points_as_numbers(const Problem& problem, const Expr& e);
/// Terms that hold samples outside of mean, sum and integral, taken once: in the first cell of the grid.
Expr over_one_cell(Draft& draft, const Expr& e);

/// A formula, or load("path") with or without a variable, for each component of `subject`.
std::vector<Source> sources_of(Draft& draft, const ast::Expr& e, Purpose purpose, const std::string& subject);

}  // namespace dpde::model
