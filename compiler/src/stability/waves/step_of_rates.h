// SPDX-License-Identifier: Apache-2.0
// Steps that are functions of their rates L alone, with frozen coefficients. Those of explicit Runge-Kutta methods are
// a polynomial R(dt L): their eigenvalues are R(dt s), where s are those of L. Those of schemes with a memory are a
// matrix of such polynomials, of what they keep of one state in rows and columns: their eigenvalues are those of the
// matrix at dt s, a few for each s (E. Hairer and G. Wanner, Solving Ordinary Differential Equations II, V.1).
#pragma once

#include <cstddef>
#include <vector>

#include "model/scheme.h"
#include "stability/waves/amplification.h"

namespace dpde::stability {

class StepOfRates {
 public:
  using Polynomial = std::vector<double>;  // by powers of dt*L

  /// Of no scheme, or what one may make of a step.
  StepOfRates() = default;
  explicit StepOfRates(model::TimeScheme time);

  bool is_known() const { return !matrix_.empty(); }
  /// Empty where the step remembers.
  Polynomial polynomial() const { return matrix_.size() == 1 ? matrix_.front().front() : Polynomial{}; }
  /// Of rates times the step, all that the step makes of each.
  Eigen::VectorXcd factors(const Eigen::VectorXcd& rates) const;

  /// What a row of a step is of: a state, by its row in the rates, or what is remembered of it: 1 of the last step.
  struct Place {
    std::size_t row = 0, memory = 0;
  };
  /// Whether `g` is that step. By one wave and one perturbation that are like no other: where both sides are sums of
  /// exponentials of its angles they agree there by chance only if they do everywhere. To rounding, in units in which
  /// all states are alike. False where either is no such sum, as no wave stands for all others then: a mean is there
  /// only for waves that do not vary along its axes, a dealiased term only for long ones, a slope of a Fourier series
  /// not for those of two cells, and a solve gives nothing to those that its operator takes to 0.
  bool makes(const Amplification& g, const Amplification& rates, const std::vector<Place>& places, double step) const;

 private:
  /// What the step makes of a perturbation, and the sum of the sizes of its terms.
  struct Image {
    Eigen::VectorXcd value;
    Eigen::VectorXd size;
  };
  Image image(const Eigen::MatrixXcd& z, const std::vector<Place>& places, double step,
              const Eigen::VectorXd& perturbation) const;
  std::size_t degree() const;

  std::vector<std::vector<Polynomial>> matrix_;
  bool is_adams_bashforth_ = false;         // what it remembers are these, not dt times them
  std::vector<Polynomial> characteristic_;  // by powers of the factor but the highest, whose coefficient is 1
};

}  // namespace dpde::stability
