// SPDX-License-Identifier: Apache-2.0
// Constructors of expressions, and traversals. Constructors apply only identities that never change a finite value
// (x*1, x + 0, 0*x, derivatives of constants); numbers are folded only if the result is 0 or 1.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "model/model.h"

namespace dpde::model {

Expr number(double value, Origin origin = {});
Expr param(std::string name, Origin origin = {});
Expr field(std::string name, Origin origin = {});
Expr coordinate(int axis, Origin origin = {});
Expr noise(std::uint64_t seed, Origin origin = {});
Expr negate(const Expr& operand, Origin origin = {});
Expr binary(BinaryOp op, const Expr& left, const Expr& right, Origin origin = {});
Expr plus(const Expr& a, const Expr& b, Origin origin = {});
Expr minus(const Expr& a, const Expr& b, Origin origin = {});
Expr times(const Expr& a, const Expr& b, Origin origin = {});
Expr over(const Expr& a, const Expr& b, Origin origin = {});
Expr call(Fn fn, std::vector<Expr> arguments, Origin origin = {});
Expr select(const Expr& condition, const Expr& yes, const Expr& no, Origin origin = {});
/// Orders 3 and 4 are nested, with the second derivative inside.
Expr derivative(const Expr& operand, int axis, int order, Origin origin = {});
Expr advect(std::vector<Expr> velocity, const Expr& operand, Origin origin = {});
/// A uniform operand is returned unchanged.
Expr shift(const Expr& operand, std::vector<int> offset, Origin origin = {});
/// A uniform operand is returned unchanged.
Expr interpolate(const Expr& operand, Origin origin = {});
Expr band_pass(BandPass value, Origin origin = {});
Expr sample(Sample value, Origin origin = {});
/// Over all axes.
Expr reduce(Reduce::Kind reduction, const Expr& operand, Origin origin = {});
Expr reduce(Reduce reduction, Origin origin = {});
Expr apply(Apply application, Origin origin = {});
Expr network_call(NetworkCall inference, Origin origin = {});
Expr solve(Solve solved, Origin origin = {});
/// The same solve without start values and preconditioner of the model, which do not affect the exact solution.
Expr without_aids(const Solve& solved, Origin origin);

/// 1/cosh(a)^2; see support/maths/derivatives.h.
Expr slope_of_tanh(const Expr& a);
/// Whether it is a comparison or a combination of conditions.
bool is_condition(const Expr& e);
/// Whether it is uniform in space: without fields, coordinates, noise and reductions.
bool is_uniform(const Expr& e);

bool reads(const Expr& e, const std::string& field);
/// A term of a sum, with its sign.
struct Term {
  Expr value;
  bool negative;
};
/// The terms of the sum `e`.
std::vector<Term> terms_of(const Expr& e);

/// part + rest: `part` is linear in the field, `rest` does not contain it.
struct LinearPart {
  Expr part = 0.0, rest = 0.0;
};
/// Splits `e` if it is linear in the field, including its derivatives and neighbouring values; else nullopt, and
/// `nonlinear` is where linearity fails.
std::optional<LinearPart> linear_part(const Expr& e, const std::string& field, Origin& nonlinear);
/// The same with `value` instead of the field in `part`.
std::optional<LinearPart> linear_part(const Expr& e, const std::string& field, Origin& nonlinear, const Expr& value);

/// rest + factor*field; neither contains the field.
struct Linear {
  Expr rest = 0.0, factor = 0.0;
};
/// nullopt if `e` is not linear in the field at the point itself.
std::optional<Linear> linear_in(const Expr& e, const std::string& field);

/// Whether `e`, as a tree, has more than `max_nodes` nodes or is higher than `max_height`. The cost is bounded by these
/// limits.
bool is_larger_than(const Expr& e, int max_nodes, int max_height);

/// The scheme's discretisation of `e`: the one of the advected field, if the operand is a field.
const Transport& transport_of(const Scheme& scheme, const Advect& e);
/// Whether the scheme computes it, a Derivative or an Advect, by Fourier series.
bool is_spectral(const Scheme& scheme, const Expr& e);

/// The highest order of nested derivatives: 4 for lap(lap(u)); advection counts as 1.
int nested_order(const Expr& e);

}  // namespace dpde::model
