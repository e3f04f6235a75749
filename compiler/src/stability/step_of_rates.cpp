// SPDX-License-Identifier: Apache-2.0
#include "stability/step_of_rates.h"

#include <cmath>
#include <limits>

#include "stability/eigenvalues.h"

namespace dpde::stability {

bool is_step_of_rates(const Amplification& g, const Amplification& rates, const std::vector<double>& polynomial,
                      double step) {
  // Units of rounding for each state and power. A product of complex matrices rounds by one of each at most (N. J.
  // Higham, Accuracy and Stability of Numerical Algorithms, 3.6), the stages of the step by as much; six are left for
  // sums over the places of a difference, and for phases, by half a unit for each cell of their distance. Where more is
  // lost, as in high derivatives along one axis, the answer is no, which costs time alone.
  constexpr double roundings = 8;
  constexpr Angles any_wave{1, 0.7, 0.4};
  // What a step carries beside its states, as the first guess of a solve, has no rates.
  if (g.size() != rates.size() || !g.is_sum_of_exponentials() || !rates.is_sum_of_exponentials()) return false;
  const Eigen::MatrixXcd z = step * rates.at(any_wave);
  const Eigen::MatrixXd sizes = z.cwiseAbs();
  Eigen::MatrixXcd power = Eigen::MatrixXcd::Identity(z.rows(), z.cols()), sum = polynomial.front() * power;
  Eigen::MatrixXd power_of_sizes = power.real(), sum_of_sizes = power_of_sizes;
  for (std::size_t k = 1; k < polynomial.size(); ++k) {
    power = (z * power).eval();
    power_of_sizes = (sizes * power_of_sizes).eval();
    sum += polynomial[k] * power;
    sum_of_sizes += std::abs(polynomial[k]) * power_of_sizes;
  }
  const Eigen::VectorXd scales = scales_of(sum_of_sizes);
  const Eigen::MatrixXd units = scales.cwiseInverse() * scales.transpose();
  const double error = (g.at(any_wave) - sum).cwiseProduct(units).norm(),
               size = sum_of_sizes.cwiseProduct(units).norm();
  const auto units_of_error = roundings * static_cast<double>(z.rows()) * static_cast<double>(polynomial.size() - 1);
  return error <= units_of_error * std::numeric_limits<double>::epsilon() * size;
}

}  // namespace dpde::stability
