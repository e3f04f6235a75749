// SPDX-License-Identifier: Apache-2.0
// What the values of a loss along a line say of its derivative there: remainders, their slope, difference quotients.
// This is the only place that knows when numbers with kinks in them (abs, max, if, interpolation, relu) prove a
// derivative.
//
// With f the loss along the line, g the derivative to be judged and R(h) = f(h) - f(0) - h*g:
//
//  - Where f is smooth, R falls as h^2. A wrong g leaves a term of first order in R, however little of it is wrong.
//  - A kink at the distance s, where the derivative jumps by j, adds j*(h - s) to R for steps that reach it.
//    Hundreds of kinks make R fall as h^2 on average, and a slope measured over a few steps is anything: 1.2 to 2.1
//    in shipped examples that are right. So the slope proves a derivative where it is 2 and proves nothing where it
//    is not.
//  - A jump of f at the distance s adds its whole size to R for steps that reach it, and R does not fall. Then no
//    derivative tells what f does, and none is certified.
//  - The quotients from both sides, C(h) = (f(h) - f(-h))/(2 h), then decide. A right g is what they come to, as
//    smaller steps reach fewer kinks. Where g is wrong they agree with one another on another number.
//
// The rule, for programs with kinks and without: g is the derivative when the slope is within 0.05 of 2, or R is
// nothing but rounding, or else the quotients of three neighbouring steps come within 1e-5 of g or within their
// rounding, unless those of the three smallest steps at which rounding lets a difference be seen agree on another
// number, with g outside what the two sides say (inside, the point may lie on a kink itself). How large rounding is, is
// measured: by fourth differences of the loss at eight points close together, which leave nothing of a smooth f.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

namespace dpde::analysis {

constexpr double largest_slope_error = 0.05;
/// Of quotients, in double and in single precision; what is smaller is seen by dot products.
constexpr double largest_quotient_error = 1e-5, largest_single_quotient_error = 1e-3;

struct Remainder {
  double step, value;
};
/// The slope of remainders over halved steps: the mean over the three neighbouring points whose slopes agree best,
/// above `floor`; nullopt when no three points lie above it.
std::optional<double> remainder_slope(const std::vector<Remainder>& remainders, double floor);
/// The same where larger steps may cross kinks and jumps: of the smallest steps whose slopes agree.
std::optional<double> slope_at_small_steps(const std::vector<Remainder>& remainders, double floor);
/// Whether they fall as squares of the steps wherever they are above `floor`: of what jumps they do not.
bool falls_as_squares(const std::vector<Remainder>& remainders, double floor);

/// The loss as a function of the distance along the line.
using Line = std::function<double(double)>;

/// The standard deviation of the rounding of f near 0, from eight values a small `spacing` apart; at least that of one
/// rounding of f(0), `unit` of it.
double rounding_of(const Line& f, double spacing, double unit);

/// A quotient from both sides, those of each side, and what rounding may do to them.
struct Quotient {
  double step, value, ahead, behind, rounding;
};
std::vector<Quotient> quotients_of(const Line& f, const std::vector<double>& steps, double rounding);

/// A derivative and the rounding in it.
struct DirectionalDerivative {
  double value = 0, rounding = 0;
};
/// What quotients, of larger steps first, say of a derivative. Errors are relative to the larger of derivative and
/// quotient.
struct QuotientEvidence {
  std::optional<double> error;  // the worst of the three neighbouring steps that tell most
  double rounding = INFINITY;   // of these, likewise: an error below it is rounding
  bool is_elsewhere = false;    // they agree with one another on another number

  /// Whether they tell anything: rounding may hide a hundred times the largest error, and no more.
  bool is_resolved(double largest_error) const { return rounding <= 100 * largest_error; }
  bool proves(double largest_error) const {
    return is_resolved(largest_error) && !is_elsewhere && *error <= std::max(largest_error, rounding);
  }
};
QuotientEvidence judge(const std::vector<Quotient>& quotients, const DirectionalDerivative& derivative);

/// Where f has two values next to one another.
struct JumpOnLine {
  double at = 0, size = 0;
};
/// A jump between -reach and reach that is larger than rounding: where neighbouring differences differ most, and do so
/// however close the points are. So is what rises between points less than `closest` apart as it does between those of
/// the level before, where a kink leaves a sixteenth: no step of that size sees it as a slope.
std::optional<JumpOnLine> jump_within(const Line& f, double reach, double rounding, double closest = 0);
/// Such a jump, or a rise narrower than the smallest step, where differences over some of the steps, the larger first,
/// disagree with the derivative by more than a thousandth: they do so by kinks too, which are no jumps.
std::optional<JumpOnLine> jump_beside(const Line& f, double derivative, const std::vector<double>& steps,
                                      double rounding);

}  // namespace dpde::analysis
