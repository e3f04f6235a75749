// SPDX-License-Identifier: Apache-2.0
// Functions that convert parts of formulas, by the file that defines them. Other folders include formula_scope.h.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/from_ast/formulas/formula_scope.h"

namespace dpde::model::formulas {

/// An operand: its text and its value.
struct Operand {
  const ast::Expr& source;
  TypedExpr value;
};

// boundary/wall_integrals.cpp
/// The argument at = y.low, or null.
const ast::Argument* wall_of(const ast::Call& e);
/// integral(e, at = y.low), mean(e, at = y.low)
TypedExpr wall_reduction(FormulaScope& here, Reduce::Kind kind, const ast::Call& e, SourceRange range);

// formulas/arithmetic.cpp
TypedExpr arithmetic(FormulaScope& here, BinaryOp op, const Operand& left, const Operand& right, SourceRange range);

// formulas/expressions.cpp
TypedExpr refuse(FormulaScope& here, const std::string& what, SourceRange range, const std::string& name = "");
bool is_too_large(FormulaScope& here, const TypedExpr& value, SourceRange range);
std::optional<Expr> as_number(FormulaScope& here, const TypedExpr& value, SourceRange range);
TypedExpr named(FormulaScope& here, const ast::Name& e, SourceRange range);
/// As `any`, with the unit of a sum, too: for values that stand behind a name.
TypedExpr measured(FormulaScope& here, const ast::Expr& e);
/// Component `axis` of a vector, or part `i` of a tensor.
TypedExpr part_of(const TypedExpr& whole, int i);
bool has_axis(FormulaScope& here, int axis, SourceRange range);

// formulas/operators.cpp
TypedExpr application(FormulaScope& here, const FunctionScope& call, const ast::Call& e, SourceRange range);

// formulas/quadrature.cpp
bool is_quadrature(const ast::Call& e);
TypedExpr quadrature(FormulaScope& here, const ast::Call& e, SourceRange range);

// formulas/reductions.cpp
TypedExpr reduction(FormulaScope& here, const ast::Call& e, SourceRange range);
/// Of two numbers, or over space.
TypedExpr extreme(FormulaScope& here, const ast::Call& e, SourceRange range);
/// Of a formula between two limits, or over space.
TypedExpr integral(FormulaScope& here, const ast::Call& e, SourceRange range);

// formulas/tensors.cpp
/// The identity tensor, which reads no values.
TypedExpr identity(FormulaScope& here);
/// ((a, b), (c, d)), one row per component, one column per axis.
TypedExpr rows(FormulaScope& here, const ast::Tuple& e);
TypedExpr outer_product(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr inner_product(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr symmetric(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr transpose(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr trace(FormulaScope& here, const ast::Call& e, SourceRange range);
/// a . b: a number for two vectors, a vector for a tensor and a vector; the sum over the adjacent indices.
TypedExpr dot_product(FormulaScope& here, const ast::Call& e, SourceRange range);
/// Warns if an operand contains nested derivatives of higher order than `allowed`.
void look_beside_poles(FormulaScope& here, const std::vector<Expr>& operand, int allowed, SourceRange range);
/// d v_i/dx_j
TypedExpr vector_gradient(FormulaScope& here, const std::vector<Expr>& v, SourceRange range);
TypedExpr tensor_divergence(FormulaScope& here, const std::vector<Expr>& s, SourceRange range);
/// S.xy of a name or of a parenthesised expression; `part` is "xy".
TypedExpr tensor_component(FormulaScope& here, const TypedExpr& whole, const ast::Identifier& part);

// formulas/vectors.cpp
TypedExpr tuple(FormulaScope& here, const ast::Tuple& e);
/// One component per axis.
std::optional<std::vector<Expr>> as_vector(FormulaScope& here, const TypedExpr& value, SourceRange range);
TypedExpr vector(FormulaScope& here, const std::string& name, SourceRange range);
/// u.x if it is not a field itself: a component of a let, or an error.
TypedExpr component(FormulaScope& here, const ast::Identifier& name);
/// grad(u).x; on one axis a number also counts as a vector.
TypedExpr component(FormulaScope& here, const ast::Component& e, SourceRange range);
TypedExpr laplacian(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr gradient(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr divergence(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr advection(FormulaScope& here, const ast::Call& e, SourceRange range);
/// [a, b] = dx(a) dy(b) - dy(a) dx(b), as the mean of three forms; the other two are dx(a dy(b)) - dy(a dx(b)) and dy(b
/// dx(a)) - dx(b dy(a)). If differences satisfy summation by parts, the sums of b times the first and the third form
/// cancel, and that of b times the second is 0; likewise for a. So the sums of a [a, b], b [a, b] and [a, b] are 0.
/// With differences of order 2 this is the nine-point form of A. Arakawa, J. Comput. Phys. 1 (1966) 119, equation 46.
TypedExpr poisson_bracket(FormulaScope& here, const ast::Call& e, SourceRange range);
/// On two axes dx(v.y) - dy(v.x), a number, or for a number s the vector (dy(s), -dx(s)); on three axes a vector.
TypedExpr curl(FormulaScope& here, const ast::Call& e, SourceRange range);
/// s k x v, with k normal to both axes.
TypedExpr cross_product(FormulaScope& here, const ast::Call& e, SourceRange range);
/// v|; for a number abs(v).
TypedExpr magnitude(FormulaScope& here, const ast::Expr& operand, SourceRange range);
/// sqrt(dot(v, v)), with slope 0 at v = 0: there the root has infinite slope, so the root of 1 is computed but not
/// used.
TypedExpr norm(const TypedExpr& value, SourceRange range);

// formulas/calls.cpp
TypedExpr call(FormulaScope& here, const ast::Call& e, SourceRange range);
/// Whether the call has `count` unnamed arguments.
bool takes(FormulaScope& here, const ast::Call& e, int count);
TypedExpr rate(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr load(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr elementary(FormulaScope& here, const ast::Call& e, SourceRange range);
/// atan2(y, x): the angle of (x, y) with the x axis, in (-pi, pi]; 0 at the origin.
TypedExpr angle(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr choice(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr along_axis(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr along_named_axis(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr norm_call(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr interpolation(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr band(FormulaScope& here, const ast::Call& e, SourceRange range);

// names/functions.cpp
TypedExpr user_call(FormulaScope& here, const ast::Function& function, const ast::Call& e, SourceRange range);
TypedExpr name_in_function(FormulaScope& here, const std::string& name, SourceRange range);
TypedExpr offsets(FormulaScope& here, const ast::Offsets& e, SourceRange range);

// names/scene_names.cpp
TypedExpr scene_let(FormulaScope& here, const std::string& name, SourceRange range);
/// The formula given by the scene for a state or coefficient.
TypedExpr given(FormulaScope& here, const std::string& name, const Symbol& meaning, SourceRange range);

// physics/forces.cpp
/// force_on(solid, u): the amount that a mask takes from a fixed field per unit of time; the integral of its right-hand
/// side over the points inside.
TypedExpr force(FormulaScope& here, const ast::Call& e, SourceRange range);
/// The torque of that force about a point: a number on two axes, a vector on three.
TypedExpr torque(FormulaScope& here, const ast::Call& e, SourceRange range);

// physics/random.cpp
TypedExpr random_waves(FormulaScope& here, const ast::Call& e, SourceRange range);
/// Allowed only where it is evaluated once: in an equation it would look like noise in time.
TypedExpr white_noise(FormulaScope& here, const ast::Call& e, SourceRange range);

// scene/points.cpp
TypedExpr injection(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr sampling(FormulaScope& here, const ast::Call& e, SourceRange range);

// task/averages.cpp
/// The mean over the states of a loss, represented by a named number.
TypedExpr average(FormulaScope& here, const ast::Call& e, SourceRange range);

// task/inferences.cpp
TypedExpr inference(FormulaScope& here, const DeclaredNetwork& declared, const ast::Call& e,
                    const ast::Identifier* output, SourceRange range);

}  // namespace dpde::model::formulas
