/* SPDX-License-Identifier: Apache-2.0 */
/* Functions of polynomials of wave numbers, by which transforms multiply Fourier modes.
 *
 * Those of exponential integrators (S. M. Cox and P. C. Matthews, J. Comput. Phys. 176, 2002, 430):
 *   phi_0(z) = exp(z), phi_N(z) = integral from 0 to 1 of exp((1-s)*z) * s^(N-1)/(N-1)! ds = sum_j z^j/(j+N)!
 * For large z by the recursion phi_N = (phi_M - 1/M!)/z with M = N-1, which loses digits for small z; there by the
 * series. The derivative is phi_N' = phi_N - N*phi_P with P = N+1.
 *
 * For equations that are solved mode by mode: inverse_N(z) = z^-N, and 0 if z is 0, so that the solution has the
 * smallest norm. The derivative is inverse_N' = -N*inverse_P, also 0 there.
 *
 * For parts of spectra: heaviside(z) = 1 if z > 0, else 0, for a z that is real for each mode and depends on no
 * parameter. */
#ifndef DPDE_WAVE_FUNCTIONS_H
#define DPDE_WAVE_FUNCTIONS_H

#include <cmath>
#include <complex>

namespace dpde {

/* Added to the power of a monomial (kernel_abi.h) that is 0 for modes of wavelength 2 cells along the axis, such as
 * first derivatives at cell centres. Even, so that it does not change the parity of the power. */
constexpr int vanishing_power = 32;

inline std::complex<double> phi(int number, std::complex<double> z) {
  if (number == 0) return std::exp(z);
  const double least = 1 + 0.5 * number; /* below, the recursion loses number*log2(|z|) bits of phi */
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

/// `size` is the sum of the magnitudes of the terms of z: z counts as 0 if only rounding is left.
inline std::complex<double> inverse(int number, std::complex<double> z, double size) {
  constexpr double rounding = 1e-13;
  if (std::abs(z) <= rounding * size) return 0;
  std::complex<double> value = 1;
  for (int n = 0; n < number; ++n) value /= z;
  return value;
}

}  // namespace dpde
#endif
