// SPDX-License-Identifier: Apache-2.0
// What each term of the equations has of their rates about a point. Rates are sums over terms, so a problem with a
// factor before each of them is lowered once, for all terms.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/model.h"
#include "stability/stability_report.h"
#include "stability/waves/amplification.h"

namespace dpde::stability {

/// A term of a state's right side, as a person wrote it: what comes from one part of the text, lap(u) as an example.
struct RateTerm {
  std::string state;
  SourceRange range;  // what comes from none is one term, too
  model::Expr value;
};
/// Those of the states of the group; none of a right side that is a field of rates.
std::vector<RateTerm> rate_terms(const model::Problem& problem, const StateGroup& group);

class RatesOfTerms {
 public:
  /// nullopt where the step is no function of rates (see step_of_rates.h), or these are not sums over the terms.
  static std::optional<RatesOfTerms> make(const model::Problem& problem, const StabilityReport& verdict,
                                          const std::vector<RateTerm>& terms);

  /// Whether the wave that limits the step still grows without this term, in a step of this length, more than the
  /// equations without it could let it; false where that is not known so. They let waves grow by no more than
  /// Gershgorin's discs reach, which takes no eigenvalues but those of the one wave.
  bool surely_grows_without(std::size_t term, double step) const;

 private:
  RatesOfTerms() = default;
  struct Reach {
    double right = 0, size = 0;  // of a row's disc for all waves: the largest real part, and the largest magnitude
  };
  Reach reach_of(const LinearForm& row, std::size_t state) const;

  StepOfRates step_of_rates_;
  Angles wave_{};
  int rank_ = 1;
  bool are_spectral_ = false;
  std::vector<std::size_t> row_of_;  // of each term, among the states of the group
  std::vector<LinearForm> parts_;    // what this row has of it alone
  std::vector<LinearForm> rows_;
  Eigen::MatrixXcd of_wave_;
  Eigen::VectorXd scales_;      // of states: they have units
  std::vector<Reach> reaches_;  // of these rows
};

}  // namespace dpde::stability
