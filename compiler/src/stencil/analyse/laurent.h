// SPDX-License-Identifier: Apache-2.0
// Arithmetic of truncated Laurent series in the cell width h, for h -> 0 from above: what a difference formula gives of
// smooth fields, power by power. Each coefficient knows how large the numbers were that it came of, so that one that is
// 0 but for rounding (and for the digits of a decimal 0.1666666667) is told from a small one.
#pragma once

#include <vector>

#include "support/vocabulary.h"

namespace dpde::stencil {

struct LaurentTerm {
  double value = 0;
  double scale = 0;  // of what it came of; its error is rounding times that
  bool is_zero() const;
};

/// sum of terms[i]*h^(low + i); what follows is not known. Without terms nothing is: what has no such series, as
/// log(0), sqrt(h) or exp(1/h), and all that is made of it.
struct Laurent {
  int low = 0;
  std::vector<LaurentTerm> terms;
  int end() const { return low + static_cast<int>(terms.size()); }
  bool is_known() const { return !terms.empty(); }
};

constexpr int laurent_terms = 26;  // of what is known exactly

Laurent no_series();
/// value*h^power
Laurent monomial(double value, int power = 0);
/// The power of the first coefficient that is not 0; end() where all are.
int valuation(const Laurent& s);
/// -1, 0 or 1 for small h > 0.
int sign_of(const Laurent& s);

Laurent operator-(const Laurent& a);
Laurent operator+(const Laurent& a, const Laurent& b);
Laurent operator-(const Laurent& a, const Laurent& b);
Laurent operator*(const Laurent& a, const Laurent& b);
Laurent operator/(const Laurent& a, const Laurent& b);
Laurent power(const Laurent& base, const Laurent& exponent);
Laurent call(Fn fn, const std::vector<Laurent>& arguments);

}  // namespace dpde::stencil
