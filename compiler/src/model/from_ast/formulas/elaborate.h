// SPDX-License-Identifier: Apache-2.0
// The parts of formulas, each elaborated by the file that knows it. Other rooms include formula_scope.h.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/from_ast/formulas/formula_scope.h"

namespace dpde::model::formulas {

/// A side of an operation: what is written, and what it is.
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
/// Of a formula between two ends, or over space.
TypedExpr integral(FormulaScope& here, const ast::Call& e, SourceRange range);

// formulas/tensors.cpp
/// identity, in which nothing is taken anywhere.
TypedExpr identity(FormulaScope& here);
/// ((a, b), (c, d)), each row with a component for each axis.
TypedExpr rows(FormulaScope& here, const ast::Tuple& e);
TypedExpr outer_product(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr inner_product(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr symmetric(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr transpose(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr trace(FormulaScope& here, const ast::Call& e, SourceRange range);
/// a . b of two vectors is a number, of a tensor and a vector a vector: the sum over the indices that are neighbours.
TypedExpr dot_product(FormulaScope& here, const ast::Call& e, SourceRange range);
/// Warns where the operand of an operator holds derivatives, up to `allowed` inside one another.
void look_beside_poles(FormulaScope& here, const std::vector<Expr>& operand, int allowed, SourceRange range);
/// d v_i/dx_j
TypedExpr vector_gradient(FormulaScope& here, const std::vector<Expr>& v, SourceRange range);
TypedExpr tensor_divergence(FormulaScope& here, const std::vector<Expr>& s, SourceRange range);
/// S.xy, of a name or of what stands in parentheses; `part` is "xy".
std::optional<Expr> tensor_component(FormulaScope& here, const TypedExpr& whole, const ast::Identifier& part);

// formulas/vectors.cpp
TypedExpr tuple(FormulaScope& here, const ast::Tuple& e);
/// One component an axis.
std::optional<std::vector<Expr>> as_vector(FormulaScope& here, const TypedExpr& value, SourceRange range);
TypedExpr vector(FormulaScope& here, const std::string& name, SourceRange range);
/// u.x where that is no field by itself: of a let, or a mistake.
TypedExpr component(FormulaScope& here, const ast::Identifier& name);
/// grad(u).x; on one axis a number is a vector as well.
TypedExpr component(FormulaScope& here, const ast::Component& e, SourceRange range);
TypedExpr laplacian(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr gradient(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr divergence(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr advection(FormulaScope& here, const ast::Call& e, SourceRange range);
/// [a, b] = dx(a) dy(b) - dy(a) dx(b), as a third of three forms of it, the others being dx(a dy(b)) - dy(a dx(b)) and
/// dy(b dx(a)) - dx(b dy(a)). With differences that sum by parts the first form's sum with b is that of the third with
/// the other sign, the second's is 0, and so in turn for a: sums of a [a, b], b [a, b] and [a, b] itself are 0. With
/// differences of order 2 these are the nine points of A. Arakawa, J. Comput. Phys. 1 (1966) 119, equation 46.
TypedExpr poisson_bracket(FormulaScope& here, const ast::Call& e, SourceRange range);
/// On two axes dx(v.y) - dy(v.x), a number, or of a number s the vector (dy(s), -dx(s)); on three a vector.
TypedExpr curl(FormulaScope& here, const ast::Call& e, SourceRange range);
/// s k x v, k across both axes.
TypedExpr cross_product(FormulaScope& here, const ast::Call& e, SourceRange range);
/// |v| of a number is abs(v).
TypedExpr magnitude(FormulaScope& here, const ast::Expr& operand, SourceRange range);
/// sqrt(dot(v, v)) with slope 0 where v is 0: there the root, of slope infinity, is taken of 1 and not used.
TypedExpr norm(const TypedExpr& value, SourceRange range);

// formulas/calls.cpp
TypedExpr call(FormulaScope& here, const ast::Call& e, SourceRange range);
/// Whether the call has `count` arguments, all without names.
bool takes(FormulaScope& here, const ast::Call& e, int count);
TypedExpr rate(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr load(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr elementary(FormulaScope& here, const ast::Call& e, SourceRange range);
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
/// The formula that the scene gives a state or coefficient.
TypedExpr given(FormulaScope& here, const std::string& name, const Symbol& meaning, SourceRange range);

// physics/forces.cpp
/// force_on(solid, u): what a mask takes of a field that it holds, in a unit of time; the integral of its rate over the
/// points inside.
TypedExpr force(FormulaScope& here, const ast::Call& e, SourceRange range);
/// The moment of that force about a point: a number on two axes, a vector on three.
TypedExpr torque(FormulaScope& here, const ast::Call& e, SourceRange range);

// physics/random.cpp
TypedExpr random_waves(FormulaScope& here, const ast::Call& e, SourceRange range);
/// Only where it is evaluated once: in an equation it would look like noise in time.
TypedExpr white_noise(FormulaScope& here, const ast::Call& e, SourceRange range);

// scene/points.cpp
TypedExpr injection(FormulaScope& here, const ast::Call& e, SourceRange range);
TypedExpr sampling(FormulaScope& here, const ast::Call& e, SourceRange range);

// task/averages.cpp
/// The mean over the states that a loss looks at: a number that stands for it.
TypedExpr average(FormulaScope& here, const ast::Call& e, SourceRange range);

// task/inferences.cpp
TypedExpr inference(FormulaScope& here, const DeclaredNetwork& declared, const ast::Call& e,
                    const ast::Identifier* output, SourceRange range);

}  // namespace dpde::model::formulas
