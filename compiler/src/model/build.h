// SPDX-License-Identifier: Apache-2.0
// Constructors of expressions with the identities that never change a finite value (x*1, x + 0, 0*x, derivatives of
// constants; numbers are folded only where the result is 0 or 1), and the traversals of this level.
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
/// Orders 3 and 4 are nested: the second derivative inside.
Expr derivative(const Expr& operand, int axis, int order, Origin origin = {});
Expr advect(std::vector<Expr> velocity, const Expr& operand, Origin origin = {});
/// Of what is the same everywhere, itself.
Expr shift(const Expr& operand, std::vector<int> offset, Origin origin = {});
/// Of what is the same everywhere, itself.
Expr interpolate(const Expr& operand, Origin origin = {});
Expr band_pass(BandPass value, Origin origin = {});
Expr sample(Sample value, Origin origin = {});
/// Over all axes.
Expr reduce(Reduce::Kind reduction, const Expr& operand, Origin origin = {});
Expr reduce(Reduce reduction, Origin origin = {});
Expr apply(Apply application, Origin origin = {});
Expr network_call(NetworkCall inference, Origin origin = {});
Expr solve(Solve solved, Origin origin = {});
/// The same solve beginning with nothing of the model's: what a solution depends on.
Expr without_aids(const Solve& solved, Origin origin);

/// `e` where it is a T, else nullptr.
template <class T>
const T* as(const Expr& e) {
  return std::get_if<T>(&e->kind);
}
bool is_constant(const Expr& e, double value);
/// Whether it compares, or combines conditions.
bool is_condition(const Expr& e);
/// Neither fields nor coordinates nor noise nor reductions: the same at all points.
bool is_uniform(const Expr& e);
bool holds_reduction(const Expr& e);

bool reads(const Expr& e, const std::string& field);
/// A term of a sum, and whether it is subtracted.
struct Term {
  Expr value;
  bool negative;
};
/// Those that `e` is a sum of.
std::vector<Term> terms_of(const Expr& e);

/// part + rest, the first of which is linear in the field, the second does not read it.
struct LinearPart {
  Expr part = 0.0, rest = 0.0;
};
/// Of what is linear in the field, also by derivatives and values of neighbours; else nullopt, and `nonlinear` is where
/// it is not.
std::optional<LinearPart> linear_part(const Expr& e, const std::string& field, Origin& nonlinear);
/// The same with `value` in the place of the field.
std::optional<LinearPart> linear_part(const Expr& e, const std::string& field, Origin& nonlinear, const Expr& value);

/// rest + factor*field, neither of which reads the field.
struct Linear {
  Expr rest = 0.0, factor = 0.0;
};
/// nullopt where `e` is not linear in the field at the point itself.
std::optional<Linear> linear_in(const Expr& e, const std::string& field);

/// Calls `f` on each direct child.
void for_each_part(const Expr& e, const std::function<void(const Expr&)>& f);
/// `e` with what `f` makes of each of these in its place.
Expr map_parts(const Expr& e, const std::function<Expr(const Expr&)>& f);
/// Whether `f` is true of `e` or of something below it.
bool any_part(const Expr& e, const std::function<bool(const Expr&)>& f);

/// Whether `e`, as a tree, has more than `max_nodes` nodes or is higher than `max_height`; takes at most that long.
bool is_larger_than(const Expr& e, int max_nodes, int max_height);

/// How the scheme discretises it: what it says of the field that is carried, where that is one.
const Transport& transport_of(const Scheme& scheme, const Advect& e);
/// Whether the scheme takes it by a Fourier series: a Derivative or an Advect.
bool is_spectral(const Scheme& scheme, const Expr& e);

/// The largest order of derivatives inside one another: 4 for lap(lap(u)); advection counts as 1.
int nested_order(const Expr& e);

}  // namespace dpde::model
