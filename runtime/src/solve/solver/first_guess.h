// SPDX-License-Identifier: Apache-2.0
// The best multiples of guesses to begin iterations with.
#pragma once

#include <Eigen/Core>
#include <span>

#include "dpde/runtime/team.h"
#include "solve/operator/grid_operator.h"

namespace dpde {

class FirstGuess {
 public:
  struct Rounding {
    double of_entries;  // relative
    double of_image;    // of A*x, over |x|
  };
  /// x = the sum of multiples of `guesses`, one behind the other, that leaves the least of b; 0 where there is none.
  /// What no image shows is taken from the guesses. Memory is taken for the images of guesses behind the first.
  void find(const GridOperator& a, std::span<const double> b, std::span<double> guesses, const Rounding& rounding,
            std::span<double> x, const Team& team);

 private:
  Eigen::MatrixXd images_, factor_;  // of guesses behind the first, orthonormal; what makes these of them
};

}  // namespace dpde
