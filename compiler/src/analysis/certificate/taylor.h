// SPDX-License-Identifier: Apache-2.0
// Tests of a directional derivative by values of a loss along a line: remainders, their slope, difference quotients.
// The rule that decides when these prove a derivative of functions with kinks (abs, max, if, interpolation, relu) is
// defined here only.
//
// With f the loss along the line, g the derivative to test, and R(h) = f(h) - f(0) - h*g:
//
// - Where f is smooth, R falls as h^2. Any error of g leaves a first-order term in R.
// - A kink at distance s, where the derivative jumps by j, adds j*(h - s) to R for steps beyond s. With hundreds of
//   kinks R falls as h^2 on average, but a slope over a few steps is arbitrary: 1.2 to 2.1 in correct shipped examples.
//   So a slope of 2 proves a derivative; another slope proves nothing.
// - A jump of f at distance s adds its size to R for steps beyond s, and R does not fall. Then no derivative describes
//   f, and none is certified.
// - Then the central quotients C(h) = (f(h) - f(-h))/(2 h) decide. They converge to a right g, as smaller steps reach
//   fewer kinks. If g is wrong, they converge to another number.
//
// The rule, with or without kinks: g is the derivative if the slope is within 0.05 of 2, or if R is only rounding, or
// else if the quotients of three adjacent steps are within 1e-5 of g or within rounding. Exception: the quotients of
// the three smallest steps with a significant difference agree on another number, and g is outside the range of the
// one-sided quotients (inside, the point may be on a kink). Rounding is measured by fourth differences of the loss at
// eight close points, which vanish for smooth f.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

namespace dpde::analysis {

constexpr double largest_slope_error = 0.05;
/// For quotients in double and in single precision; dot products detect smaller errors.
constexpr double largest_quotient_error = 1e-5, largest_single_quotient_error = 1e-3;

struct Remainder {
  double step, value;
};
/// The slope of remainders over halved steps: mean over the three adjacent points above `floor` whose slopes agree
/// best; nullopt if there are no three such points.
std::optional<double> remainder_slope(const std::vector<Remainder>& remainders, double floor);
/// The same if larger steps may cross kinks and jumps: uses the smallest steps whose slopes agree.
std::optional<double> slope_at_small_steps(const std::vector<Remainder>& remainders, double floor);
/// Whether all remainders above `floor` fall as h^2; after a jump they do not.
bool falls_as_squares(const std::vector<Remainder>& remainders, double floor);

/// The loss as a function of distance along a line.
using Line = std::function<double(double)>;

/// Standard deviation of the rounding of f near 0, from eight values a small `spacing` apart; at least `unit` times
/// |f(0)|.
double rounding_of(const Line& f, double spacing, double unit);

/// A central quotient, the two one-sided ones, and their rounding.
struct Quotient {
  double step, value, ahead, behind, rounding;
};
std::vector<Quotient> quotients_of(const Line& f, const std::vector<double>& steps, double rounding);

/// A derivative and its rounding.
struct DirectionalDerivative {
  double value = 0, rounding = 0;
};
/// Test of a derivative by quotients, largest steps first. Errors are relative to the larger of derivative and
/// quotient.
struct QuotientEvidence {
  std::optional<double> error;  // largest of the three adjacent steps that are most conclusive
  double rounding = INFINITY;   // likewise; an error below it is rounding
  bool is_elsewhere = false;    // they converge to another number

  /// Whether the quotients are conclusive: rounding is at most a hundred times the largest error.
  bool is_resolved(double largest_error) const { return rounding <= 100 * largest_error; }
  bool proves(double largest_error) const {
    return is_resolved(largest_error) && !is_elsewhere && *error <= std::max(largest_error, rounding);
  }
};
QuotientEvidence judge(const std::vector<Quotient>& quotients, const DirectionalDerivative& derivative);

/// A jump of f.
struct JumpOnLine {
  double at = 0, size = 0;
};
/// Looks for a jump larger than rounding between -reach and reach: neighbouring differences differ there however close
/// the points are. A rise also counts as a jump if between points less than `closest` apart it is as large as on the
/// level before, since no step of that size sees it as a slope; a kink leaves a sixteenth.
std::optional<JumpOnLine> jump_within(const Line& f, double reach, double rounding, double closest = 0);
/// Looks for such a jump, or a rise narrower than the smallest step, if differences over some of the steps (largest
/// first) deviate from the derivative by more than a thousandth. Kinks also cause this, but are no jumps.
std::optional<JumpOnLine> jump_beside(const Line& f, double derivative, const std::vector<double>& steps,
                                      double rounding);

}  // namespace dpde::analysis
