// SPDX-License-Identifier: Apache-2.0
#include "stability/waves/step_of_rates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <span>

#include "stability/eigenvalues/eigenvalues.h"
#include "stability/waves/roots.h"
#include "stencil/time/multistep.h"
#include "stencil/time/time_schemes.h"

namespace dpde::stability {

namespace {

using Polynomial = StepOfRates::Polynomial;
using PolynomialMatrix = std::vector<std::vector<Polynomial>>;

void add_product(Polynomial& to, double factor, const Polynomial& a, const Polynomial& b) {
  if (a.empty() || b.empty()) return;
  to.resize(std::max(to.size(), a.size() + b.size() - 1));
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t k = 0; k < b.size(); ++k) to[i + k] += factor * a[i] * b[k];
  }
}

PolynomialMatrix product_of(const PolynomialMatrix& a, const PolynomialMatrix& b) {
  PolynomialMatrix result(a.size(), std::vector<Polynomial>(a.size()));
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < a.size(); ++j) {
      for (std::size_t k = 0; k < a.size(); ++k) add_product(result[i][j], 1, a[i][k], b[k][j]);
    }
  }
  return result;
}

/// The characteristic polynomial x^n + c[n-1] x^(n-1) + ... + c[0], by the method of Faddeev and Le Verrier.
std::vector<Polynomial> characteristic_of(const PolynomialMatrix& a) {
  const std::size_t size = a.size();
  std::vector<Polynomial> result(size);
  PolynomialMatrix part = a;
  for (std::size_t k = 1; k <= size; ++k) {
    Polynomial& of_power = result[size - k];
    for (std::size_t i = 0; i < size; ++i) add_product(of_power, -1.0 / static_cast<double>(k), part[i][i], {1});
    for (std::size_t i = 0; i < size; ++i) add_product(part[i][i], 1, of_power, {1});
    part = product_of(a, part);
  }
  return result;
}

std::complex<double> value_of(const Polynomial& polynomial, const std::complex<double>& z) {
  double real = 0, imaginary = 0;
  for (std::size_t k = polynomial.size(); k-- > 0;) {
    const double next = real * z.real() - imaginary * z.imag() + polynomial[k];
    imaginary = real * z.imag() + imaginary * z.real();
    real = next;
  }
  return {real, imaginary};
}

PolynomialMatrix matrix_of(model::TimeScheme time) {
  PolynomialMatrix matrix = stencil::multistep_matrix(time);
  if (!matrix.empty()) return matrix;
  const Polynomial polynomial = stencil::stability_polynomial(time);
  return polynomial.empty() ? PolynomialMatrix{} : PolynomialMatrix{{polynomial}};
}

}  // namespace

StepOfRates::StepOfRates(model::TimeScheme time)
    : matrix_(matrix_of(time)),
      is_adams_bashforth_(model::is_adams_bashforth(time)),
      characteristic_(characteristic_of(matrix_)) {}

Eigen::VectorXcd StepOfRates::factors(const Eigen::VectorXcd& rates) const {
  if (matrix_.size() == 1) return polynomial_of(matrix_.front().front(), rates);
  const auto count = static_cast<Eigen::Index>(matrix_.size());
  Eigen::VectorXcd result(count * rates.size());
  std::array<std::complex<double>, most_roots> coefficients;
  for (Eigen::Index i = 0; i < rates.size(); ++i) {
    for (std::size_t k = 0; k < matrix_.size(); ++k) coefficients[k] = value_of(characteristic_[k], rates[i]);
    const auto roots = roots_of(std::span(coefficients).first(matrix_.size()));
    std::copy_n(roots.begin(), count, result.begin() + i * count);
  }
  return result;
}

std::size_t StepOfRates::degree() const {
  std::size_t powers = 2;
  for (const auto& row : matrix_) {
    for (const Polynomial& entry : row) powers = std::max(powers, entry.size());
  }
  return powers - 1;
}

/// Of what each memory has a vector of states: its powers of z are those of all.
StepOfRates::Image StepOfRates::image(const Eigen::MatrixXcd& z, const std::vector<Place>& places, double step,
                                      const Eigen::VectorXd& perturbation) const {
  const auto count = static_cast<Eigen::Index>(matrix_.size());
  Eigen::MatrixXcd power = Eigen::MatrixXcd::Zero(z.rows(), count);
  const auto of_memory = [&](std::size_t memory) { return is_adams_bashforth_ && memory > 0 ? step : 1; };
  for (std::size_t i = 0; i < places.size(); ++i)
    power(static_cast<Eigen::Index>(places[i].row), static_cast<Eigen::Index>(places[i].memory)) =
        perturbation[static_cast<Eigen::Index>(i)] * of_memory(places[i].memory);
  Eigen::MatrixXd power_of_sizes = power.cwiseAbs();
  const Eigen::MatrixXd sizes = z.cwiseAbs();
  Image result{Eigen::VectorXcd::Zero(perturbation.size()), Eigen::VectorXd::Zero(perturbation.size())};
  for (std::size_t k = 0; k <= degree(); ++k) {
    for (std::size_t i = 0; i < places.size(); ++i) {
      const std::vector<Polynomial>& entries = matrix_[places[i].memory];
      const auto row = static_cast<Eigen::Index>(places[i].row), to = static_cast<Eigen::Index>(i);
      for (Eigen::Index from = 0; from < count; ++from) {
        const Polynomial& entry = entries[static_cast<std::size_t>(from)];
        const double weight = k < entry.size() ? entry[k] / of_memory(places[i].memory) : 0;
        result.value[to] += weight * power(row, from);
        result.size[to] += std::abs(weight) * power_of_sizes(row, from);
      }
    }
    power = (z * power).eval();
    power_of_sizes = (sizes * power_of_sizes).eval();
  }
  return result;
}

bool StepOfRates::makes(const Amplification& g, const Amplification& rates, const std::vector<Place>& places,
                        double step) const {
  // Allowed rounding units for each state and power. A product of complex matrices costs at most one (N. J. Higham,
  // Accuracy and Stability of Numerical Algorithms, 3.6), and the stages of the step another. Six remain for sums over
  // a stencil and for phases, whose error is half a unit per cell of distance. If more is lost, as in high derivatives
  // along one axis, the answer is no, which only costs time.
  constexpr double roundings = 8;
  constexpr Angles any_wave{1, 0.7, 0.4};
  // Rows in addition to states and their histories, as the initial guess of a solve, have no row in L.
  const bool has_all = places.size() == static_cast<std::size_t>(g.size()) &&
                       places.size() == matrix_.size() * static_cast<std::size_t>(rates.size()) &&
                       std::ranges::all_of(places, [&](const Place& p) { return p.memory < matrix_.size(); });
  if (!is_known() || !has_all || !g.is_sum_of_exponentials() || !rates.is_sum_of_exponentials()) return false;
  const Eigen::MatrixXcd of_step = g.at(any_wave);
  const Eigen::VectorXd units = scales_of(of_step.cwiseAbs());
  const Eigen::VectorXd any = Eigen::VectorXd::NullaryExpr(
      g.size(), [&](Eigen::Index i) { return units[i] * (1 + 0.5 * std::sin(static_cast<double>(i * i + 1))); });
  const auto [value, size] = image(step * rates.at(any_wave), places, step, any);
  const double error = (of_step * any - value).cwiseQuotient(units).norm(), sizes = size.cwiseQuotient(units).norm();
  const auto units_of_error = roundings * static_cast<double>(rates.size()) * static_cast<double>(degree());
  return error <= units_of_error * std::numeric_limits<double>::epsilon() * sizes;
}

}  // namespace dpde::stability
