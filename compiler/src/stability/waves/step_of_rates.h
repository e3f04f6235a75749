// SPDX-License-Identifier: Apache-2.0
// Steps that are functions of the linearised right-hand side L alone, with frozen coefficients. An explicit Runge-Kutta
// step is a polynomial R(dt L): its eigenvalues are R(dt s), where s are those of L. A multistep scheme is a matrix of
// such polynomials, with a row and a column for a state and each of its stored histories: its eigenvalues are those of
// the matrix at dt s, a few for each s (E. Hairer and G. Wanner, Solving Ordinary Differential Equations II, V.1).
#pragma once

#include <cstddef>
#include <vector>

#include "model/scheme.h"
#include "stability/waves/amplification.h"

namespace dpde::stability {

class StepOfRates {
 public:
  using Polynomial = std::vector<double>;  // by powers of dt*L

  /// Default: unknown. With a scheme: its step as a function of L, if it is one.
  StepOfRates() = default;
  explicit StepOfRates(model::TimeScheme time);

  bool is_known() const { return !matrix_.empty(); }
  /// R of a one-step scheme; empty for multistep schemes.
  Polynomial polynomial() const { return matrix_.size() == 1 ? matrix_.front().front() : Polynomial{}; }
  /// All eigenvalues of the step for the given dt * s.
  Eigen::VectorXcd factors(const Eigen::VectorXcd& rates) const;

  /// A row of a step: the row of its state in L, and how many steps back it is stored (0: the state itself).
  struct Place {
    std::size_t row = 0, memory = 0;
  };
  /// Whether `g` is that step, to rounding, with states scaled to equal size. The test uses one generic wave and one
  /// generic perturbation: if both sides are sums of exponentials of the angles, they agree there only if they agree
  /// everywhere (except by chance). False if either is no such sum, as no wave is generic then: a mean acts only on
  /// waves constant along its axes, a dealiased term only on long waves, a spectral slope not on waves of two cells,
  /// and a solve gives 0 in the null space of its operator.
  bool makes(const Amplification& g, const Amplification& rates, const std::vector<Place>& places, double step) const;

 private:
  /// The step applied to a perturbation, and the sum of the magnitudes of its terms.
  struct Image {
    Eigen::VectorXcd value;
    Eigen::VectorXd size;
  };
  Image image(const Eigen::MatrixXcd& z, const std::vector<Place>& places, double step,
              const Eigen::VectorXd& perturbation) const;
  std::size_t degree() const;

  std::vector<std::vector<Polynomial>> matrix_;
  bool is_adams_bashforth_ = false;         // its histories are right-hand sides, not dt times these
  std::vector<Polynomial> characteristic_;  // by powers of g below the highest, whose coefficient is 1
};

}  // namespace dpde::stability
