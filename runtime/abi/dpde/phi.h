/* SPDX-License-Identifier: Apache-2.0 */
/* The functions of exponential integrators (S. M. Cox and P. C. Matthews, J. Comput. Phys. 176, 2002, 430):
 *   phi_0(z) = exp(z), phi_N(z) = integral from 0 to 1 of exp((1-s)*z) * s^(N-1)/(N-1)! ds = sum_j z^j/(j+N)!
 * By the recursion phi_N = (phi_M - 1/M!)/z with M = N-1 where z is large, which loses digits where it is small, and by
 * the series there. Their derivative is phi_N' = phi_N - N*phi_P with P = N+1. */
#ifndef DPDE_PHI_H
#define DPDE_PHI_H

#include <cmath>
#include <complex>

namespace dpde {

inline std::complex<double> phi(int number, std::complex<double> z) {
  if (number == 0) return std::exp(z);
  const double least = 1 + 0.5 * number; /* the recursion loses number*log2(|z|) bits of phi below 1 */
  double factorial = 1;
  if (std::abs(z) >= least) {
    std::complex<double> value = std::exp(z);
    for (int n = 1; n <= number; ++n) {
      value = (value - 1 / factorial) / z;
      factorial *= n;
    }
    return value;
  }
  for (int n = 2; n <= number; ++n) factorial *= n;
  std::complex<double> term = 1 / factorial, sum = term;
  for (int j = 1; j < 60 && std::abs(term) > 1e-18 * std::abs(sum); ++j) {
    term *= z / static_cast<double>(j + number);
    sum += term;
  }
  return sum;
}

}  // namespace dpde
#endif
