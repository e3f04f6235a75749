/* SPDX-License-Identifier: Apache-2.0 */
/* Functions of polynomials of wave numbers, by which transforms multiply waves.
 *
 * Those of exponential integrators (S. M. Cox and P. C. Matthews, J. Comput. Phys. 176, 2002, 430):
 *   phi_0(z) = exp(z), phi_N(z) = integral from 0 to 1 of exp((1-s)*z) * s^(N-1)/(N-1)! ds = sum_j z^j/(j+N)!
 * By the recursion phi_N = (phi_M - 1/M!)/z with M = N-1 where z is large, which loses digits where it is small, and by
 * the series there. Their derivative is phi_N' = phi_N - N*phi_P with P = N+1.
 *
 * Those of equations that are solved wave by wave: inverse_N(z) = z^-N, and 0 where z is 0, so that the solution is the
 * smallest one. Its derivative is inverse_N' = -N*inverse_P, 0 there too.
 *
 * Those of parts of spectra: heaviside(z), 1 where z is above 0, else 0, of a z that is a real number for each wave and
 * holds no param. */
#ifndef DPDE_WAVE_FUNCTIONS_H
#define DPDE_WAVE_FUNCTIONS_H

#include <cmath>
#include <complex>

namespace dpde {

/* A power of a monomial (kernel_abi.h) is this plus the power where the monomial is 0 for waves of two cells along the
 * axis, as first derivatives are at the centres of cells. It is even, as parity is that of the power. */
constexpr int vanishing_power = 32;

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

inline double heaviside(std::complex<double> z) { return z.real() > 0 ? 1 : 0; }

/// `size` is the sum of the sizes of what z is a sum of: z is 0 where nothing but rounding is left of it.
inline std::complex<double> inverse(int number, std::complex<double> z, double size) {
  constexpr double rounding = 1e-13;
  if (std::abs(z) <= rounding * size) return 0;
  std::complex<double> value = 1;
  for (int n = 0; n < number; ++n) value /= z;
  return value;
}

}  // namespace dpde
#endif
