// SPDX-License-Identifier: Apache-2.0
// Verdicts from the numbers of a certificate.
#include <algorithm>
#include <cmath>

#include "analysis/certificate/certificate.h"
#include "analysis/certificate/quick_certificate.h"

namespace dpde::analysis {

namespace {

constexpr double largest_second_slope_error = 0.1;

double largest_error_of(const std::vector<DotCase>& cases) {
  double result = cases.empty() ? NAN : 0;
  for (const DotCase& one : cases) {
    if (one.is_rounding) continue;
    if (std::isnan(one.relative_error)) return NAN;
    result = std::max(result, one.relative_error);
  }
  return result;
}

bool are_nothing(const std::vector<DotCase>& cases) {
  return !cases.empty() &&
         std::ranges::all_of(cases, [](const DotCase& one) { return one.is_zero || one.is_rounding; });
}

}  // namespace

bool has_slope_of_two(const std::optional<double>& slope) {
  return slope && std::abs(*slope - 2) <= largest_slope_error;
}

double Certificate::worst() const { return largest_error_of(cases); }
double SinglePrecisionCheck::worst() const { return largest_error_of(cases); }

bool Certificate::is_all_rounding() const {
  return !cases.empty() && std::ranges::all_of(cases, &DotCase::is_rounding);
}

bool Certificate::is_all_zero() const { return !cases.empty() && std::ranges::all_of(cases, &DotCase::is_zero); }

bool Certificate::tests_nothing() const { return are_nothing(cases); }
bool SecondOrderCheck::tests_nothing() const { return are_nothing(cases); }

bool Certificate::passed() const {
  const bool taylor =
      only_rounding || has_slope_of_two(slope) || (quotients && quotients->proves(largest_quotient_error));
  return start_is_finite && worst() <= largest_dot_error && taylor && (!jump || is_jump_of_scheme) &&
         jump_at_start.empty() && (!second || !second->is_wrong()) && (!single || single->passed());
}

double SecondOrderCheck::worst() const { return largest_error_of(cases); }

bool SecondOrderCheck::is_settled() const {
  return has_kinks || only_rounding || (slope && std::abs(*slope - 3) <= largest_second_slope_error);
}

bool SecondOrderCheck::is_wrong() const {
  return !(worst() <= largest_asymmetry) || (!is_settled() && quotients && quotients->is_elsewhere);
}

bool SecondOrderCheck::passed() const {
  return !is_wrong() && (is_settled() || (quotients && quotients->proves(largest_quotient_error)));
}

double usual_scale(std::vector<double> scales) {
  std::ranges::sort(scales);
  return scales.empty() ? 0 : scales[scales.size() / 2];
}

double relative_difference(double a, double b, double scale) {
  if (!std::isfinite(a) || !std::isfinite(b)) return NAN;
  const double size = std::max({std::abs(a), std::abs(b), 1e-3 * scale});
  return size > 0 ? std::abs(a - b) / size : 0;
}

}  // namespace dpde::analysis
