// SPDX-License-Identifier: Apache-2.0
// The best linear combination of guesses as the start of an iteration.
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
    double of_image;    // of A*x, relative to |x|
  };
  /// x = the linear combination of `guesses` (one after the other) with the smallest residual; 0 if there are none.
  /// Removes the null space from the guesses. Allocates memory for the images of all but the first guess.
  void find(const GridOperator& a, std::span<const double> b, std::span<double> guesses, const Rounding& rounding,
            std::span<double> x, const Team& team);

 private:
  Eigen::MatrixXd images_, factor_;  // images of all but the first guess, orthonormalised; their triangular factor
};

}  // namespace dpde
