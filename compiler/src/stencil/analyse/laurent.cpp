// SPDX-License-Identifier: Apache-2.0
// Functions of series by their differential equations: y = exp(s) satisfies y' = s'*y for every s.
#include "stencil/analyse/laurent.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "support/assert.h"

namespace dpde::stencil {

namespace {

constexpr double zero_below = 1e-9;  // times the scale
constexpr int largest_power = 64;    // larger ones are not multiplied out

LaurentTerm exact(double value) { return {value, std::abs(value)}; }
LaurentTerm operator-(const LaurentTerm& a) { return {-a.value, a.scale}; }
LaurentTerm operator+(const LaurentTerm& a, const LaurentTerm& b) { return {a.value + b.value, a.scale + b.scale}; }
LaurentTerm operator-(const LaurentTerm& a, const LaurentTerm& b) { return a + -b; }
LaurentTerm operator*(const LaurentTerm& a, const LaurentTerm& b) {
  return {a.value * b.value, std::abs(a.value) * b.scale + std::abs(b.value) * a.scale};
}
LaurentTerm operator/(const LaurentTerm& a, const LaurentTerm& b) {
  const double ratio = a.value / b.value;
  return {ratio, (a.scale + std::abs(ratio) * b.scale) / std::abs(b.value)};
}
/// f(a), with the value and the derivative of f at a.
LaurentTerm of_function(double value, double slope, const LaurentTerm& a) {
  return {value, std::abs(value) + std::abs(slope) * a.scale};
}

/// The coefficient of h^power, which must be known.
LaurentTerm at(const Laurent& s, int power) {
  return power < s.low ? LaurentTerm{} : s.terms[static_cast<std::size_t>(power - s.low)];
}

/// The series without leading coefficients that are 0.
Laurent from_first(const Laurent& s) {
  const int first = valuation(s);
  return {first, {s.terms.begin() + (first - s.low), s.terms.end()}};
}

/// The series from h^0 on, as argument of a function; unknown if the series grows for h -> 0.
Laurent taylor(const Laurent& s) {
  if (s.end() <= 0 || valuation(s) < 0) return no_series();
  Laurent result{0, {}};
  for (int power = 0; power < s.end(); ++power) result.terms.push_back(at(s, power));
  return result;
}

/// h times the derivative.
Laurent weighted_slope(const Laurent& s) {
  Laurent result = s;
  for (int power = s.low; power < s.end(); ++power) {
    LaurentTerm& term = result.terms[static_cast<std::size_t>(power - s.low)];
    term = exact(power) * term;
  }
  return result;
}

/// The series y with constant term `first` and h*y' = slope.
Laurent integral(const LaurentTerm& first, const Laurent& slope) {
  Laurent result{0, {first}};
  for (int power = 1; power < slope.end(); ++power) result.terms.push_back(at(slope, power) / exact(power));
  return result;
}

Laurent exponential(const Laurent& exponent) {
  const Laurent s = taylor(exponent);
  if (!s.is_known()) return no_series();
  const double value = std::exp(s.terms[0].value);
  Laurent y{0, {of_function(value, value, s.terms[0])}};
  for (int n = 1; n < s.end(); ++n) {
    LaurentTerm sum;
    for (int k = 1; k <= n; ++k) sum = sum + exact(k) * at(s, k) * at(y, n - k);
    y.terms.push_back(sum / exact(n));
  }
  return y;
}

Laurent logarithm(const Laurent& argument) {
  const Laurent s = taylor(argument);
  if (!s.is_known() || s.terms[0].is_zero() || s.terms[0].value < 0) return no_series();
  const double first = s.terms[0].value;
  return integral(of_function(std::log(first), 1 / first, s.terms[0]), weighted_slope(s) / s);
}

/// Sine and cosine.
std::pair<Laurent, Laurent> circle(const Laurent& angle) {
  const Laurent s = taylor(angle);
  if (!s.is_known()) return {no_series(), no_series()};
  const double first = s.terms[0].value;
  Laurent sine{0, {of_function(std::sin(first), std::cos(first), s.terms[0])}};
  Laurent cosine{0, {of_function(std::cos(first), std::sin(first), s.terms[0])}};
  for (int n = 1; n < s.end(); ++n) {
    LaurentTerm of_sine, of_cosine;
    for (int k = 1; k <= n; ++k) {
      const LaurentTerm slope = exact(k) * at(s, k);
      of_sine = of_sine + slope * at(cosine, n - k);
      of_cosine = of_cosine - slope * at(sine, n - k);
    }
    sine.terms.push_back(of_sine / exact(n));
    cosine.terms.push_back(of_cosine / exact(n));
  }
  return {sine, cosine};
}

/// base^p for a number p. The leading power of h is factored out, so that sqrt(h^2*...) is known.
Laurent number_power(const Laurent& base, double p) {
  if (p == std::round(p) && std::abs(p) <= largest_power) {
    Laurent result = monomial(1);
    for (int i = 0; i < std::abs(p); ++i) result = result * base;
    return p < 0 ? monomial(1) / result : result;
  }
  Laurent rest = from_first(base);
  const double power = rest.low * p;
  if (!rest.is_known() || power != std::round(power)) return no_series();
  rest.low = 0;
  Laurent result = exponential(monomial(p) * logarithm(rest));
  if (result.is_known()) result.low += static_cast<int>(power);
  return result;
}

/// Whether the series, from h^0 on, is a constant.
bool is_number(const Laurent& s) {
  return std::all_of(s.terms.begin() + 1, s.terms.end(), [](const LaurentTerm& c) { return c.scale == 0; });
}

Laurent arc_sine(const Laurent& argument) {
  const Laurent s = taylor(argument);
  if (!s.is_known() || !(std::abs(s.terms[0].value) < 1)) return no_series();
  const double first = s.terms[0].value;
  return integral(of_function(std::asin(first), 1 / std::sqrt(1 - first * first), s.terms[0]),
                  weighted_slope(s) / number_power(monomial(1) - s * s, 0.5));
}

Laurent arc_tangent(const Laurent& argument) {
  const Laurent s = taylor(argument);
  if (!s.is_known()) return no_series();
  const double first = s.terms[0].value;
  return integral(of_function(std::atan(first), 1 / (1 + first * first), s.terms[0]),
                  weighted_slope(s) / (monomial(1) + s * s));
}

Laurent error_function(const Laurent& argument) {
  const Laurent s = taylor(argument);
  if (!s.is_known()) return no_series();
  const double first = s.terms[0].value, factor = 2 / std::sqrt(std::numbers::pi);
  return integral(of_function(std::erf(first), factor * std::exp(-first * first), s.terms[0]),
                  monomial(factor) * weighted_slope(s) * exponential(-(s * s)));
}

Laurent rounded_down(const Laurent& argument) {
  const Laurent s = taylor(argument);
  if (!s.is_known()) return no_series();
  const double first = s.terms[0].value, nearest = std::round(first);
  if (std::abs(first - nearest) > zero_below * s.terms[0].scale) return monomial(std::floor(first));
  return monomial(sign_of(s - monomial(nearest)) < 0 ? nearest - 1 : nearest);
}

}  // namespace

bool LaurentTerm::is_zero() const { return !(std::abs(value) > zero_below * scale); }

/// Its power is so low that sums with it are unknown too.
Laurent no_series() { return {-1000000, {}}; }

Laurent monomial(double value, int power) {
  Laurent s{power, std::vector<LaurentTerm>(laurent_terms)};
  s.terms[0] = exact(value);
  return s;
}

int valuation(const Laurent& s) {
  int power = s.low;
  while (power < s.end() && at(s, power).is_zero()) ++power;
  return power;
}

int sign_of(const Laurent& s) {
  const int first = valuation(s);
  if (first == s.end()) return 0;
  return at(s, first).value < 0 ? -1 : 1;
}

Laurent operator-(const Laurent& a) {
  Laurent result = a;
  for (LaurentTerm& term : result.terms) term = -term;
  return result;
}

Laurent operator+(const Laurent& a, const Laurent& b) {
  Laurent result{std::min(a.low, b.low), {}};
  for (int power = result.low; power < std::min(a.end(), b.end()); ++power)
    result.terms.push_back(at(a, power) + at(b, power));
  return result;
}

Laurent operator-(const Laurent& a, const Laurent& b) { return a + -b; }

Laurent operator*(const Laurent& a, const Laurent& b) {
  if (!a.is_known() || !b.is_known()) return no_series();
  Laurent result{a.low + b.low, {}};
  for (std::size_t n = 0; n < std::min(a.terms.size(), b.terms.size()); ++n) {
    LaurentTerm sum;
    for (std::size_t k = 0; k <= n; ++k) sum = sum + a.terms[k] * b.terms[n - k];
    result.terms.push_back(sum);
  }
  return result;
}

Laurent operator/(const Laurent& a, const Laurent& b) {
  const Laurent bottom = from_first(b);
  if (!a.is_known() || !bottom.is_known()) return no_series();
  Laurent result{a.low - bottom.low, {}};
  for (std::size_t n = 0; n < std::min(a.terms.size(), bottom.terms.size()); ++n) {
    LaurentTerm rest = a.terms[n];
    for (std::size_t k = 1; k <= n; ++k) rest = rest - bottom.terms[k] * result.terms[n - k];
    result.terms.push_back(rest / bottom.terms[0]);
  }
  return result;
}

Laurent power(const Laurent& base, const Laurent& exponent) {
  const Laurent p = taylor(exponent);
  if (!base.is_known() || !p.is_known()) return no_series();
  return is_number(p) ? number_power(base, p.terms[0].value) : exponential(p * logarithm(base));
}

Laurent call(Fn fn, const std::vector<Laurent>& arguments) {
  if (!std::all_of(arguments.begin(), arguments.end(), [](const Laurent& a) { return a.is_known(); }))
    return no_series();
  const Laurent& s = arguments.at(0);
  const auto one = monomial(1), half = monomial(0.5);
  switch (fn) {
    case Fn::sin: return circle(s).first;
    case Fn::cos: return circle(s).second;
    case Fn::tan: return circle(s).first / circle(s).second;
    case Fn::asin: return arc_sine(s);
    case Fn::acos: return monomial(std::acos(0.0)) - arc_sine(s);
    case Fn::atan: return arc_tangent(s);
    case Fn::sinh: return half * (exponential(s) - exponential(-s));
    case Fn::cosh: return half * (exponential(s) + exponential(-s));
    case Fn::tanh: return one - monomial(2) / (exponential(s + s) + one);
    case Fn::exp: return exponential(s);
    case Fn::log: return logarithm(s);
    case Fn::erf: return error_function(s);
    case Fn::sqrt: return number_power(s, 0.5);
    case Fn::abs: return sign_of(s) < 0 ? -s : s;
    case Fn::sign: return monomial(sign_of(s));
    case Fn::floor: return rounded_down(s);
    case Fn::fraction: return s - rounded_down(s);
    case Fn::min: return sign_of(s - arguments.at(1)) <= 0 ? s : arguments.at(1);
    case Fn::max: return sign_of(s - arguments.at(1)) >= 0 ? s : arguments.at(1);
  }
  unreachable("function");
}

}  // namespace dpde::stencil
