// SPDX-License-Identifier: Apache-2.0
// Arithmetic of truncated Laurent series in the cell width h, for h -> 0 from above: the expansion of a difference
// formula for smooth fields. Each coefficient stores the magnitude of the numbers from which it was computed. So a
// coefficient that is 0 up to rounding (and up to the digits of a decimal 0.1666666667) is distinguished from a small
// one.
#pragma once

#include <vector>

#include "support/vocabulary.h"

namespace dpde::stencil {

struct LaurentTerm {
  double value = 0;
  double scale = 0;  // magnitude of its operands; the error is rounding times the scale
  bool is_zero() const;
};

/// sum of terms[i]*h^(low + i); later terms are not known. No terms: the value is not known. That holds for values
/// without such a series, such as log(0), sqrt(h) or exp(1/h), and for all results computed from them.
struct Laurent {
  int low = 0;
  std::vector<LaurentTerm> terms;
  int end() const { return low + static_cast<int>(terms.size()); }
  bool is_known() const { return !terms.empty(); }
};

constexpr int laurent_terms = 26;  // number of terms of an exactly known value

Laurent no_series();
/// value*h^power
Laurent monomial(double value, int power = 0);
/// The power of the first nonzero coefficient; end() if all are 0.
int valuation(const Laurent& s);
/// Sign of the series (-1, 0 or 1) for small h > 0.
int sign_of(const Laurent& s);

Laurent operator-(const Laurent& a);
Laurent operator+(const Laurent& a, const Laurent& b);
Laurent operator-(const Laurent& a, const Laurent& b);
Laurent operator*(const Laurent& a, const Laurent& b);
Laurent operator/(const Laurent& a, const Laurent& b);
Laurent power(const Laurent& base, const Laurent& exponent);
Laurent call(Fn fn, const std::vector<Laurent>& arguments);

}  // namespace dpde::stencil
