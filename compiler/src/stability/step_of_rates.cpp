// SPDX-License-Identifier: Apache-2.0
#include "stability/step_of_rates.h"

#include <cmath>

#include "stability/eigenvalues.h"

namespace dpde::stability {

bool is_step_of_rates(const Amplification& g, const Amplification& rates, const std::vector<double>& polynomial,
                      double step) {
  constexpr double rounding = 1e-14;  // of a sum, for each state
  constexpr Angles any_wave{1, 0.7, 0.4};
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
  return error <= rounding * static_cast<double>(z.rows()) * size;
}

}  // namespace dpde::stability
