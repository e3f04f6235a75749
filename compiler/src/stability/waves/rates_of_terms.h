// SPDX-License-Identifier: Apache-2.0
// The contribution of each term of the equations to their linearised right-hand side L about a point. L is a sum over
// terms, so one problem with a factor before each term is lowered once for all.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/model.h"
#include "stability/stability_report.h"
#include "stability/waves/amplification.h"

namespace dpde::stability {

/// A term of a state's right-hand side, as written: all that comes from one source range, lap(u) as an example.
struct RateTerm {
  std::string state;
  SourceRange range;  // parts without a range form one term
  model::Expr value;
};
/// The terms of the states of the group; none for a right-hand side that is a field.
std::vector<RateTerm> rate_terms(const model::Problem& problem, const StateGroup& group);

class RatesOfTerms {
 public:
  /// nullopt if the step is no function of L (see step_of_rates.h), or L is not a sum over the terms.
  static std::optional<RatesOfTerms> make(const model::Problem& problem, const StabilityReport& verdict,
                                          const std::vector<RateTerm>& terms);

  /// True if, in this step without this term, the limiting wave grows more than the equations without the term can
  /// allow. False means: not known. Gershgorin's discs bound the growth of the equations, so eigenvalues are needed of
  /// this one wave only.
  bool surely_grows_without(std::size_t term, double step) const;

 private:
  RatesOfTerms() = default;
  struct Reach {
    double right = 0, size = 0;  // of a row's disc over all waves: largest real part and largest magnitude
  };
  Reach reach_of(const LinearForm& row, std::size_t state) const;

  StepOfRates step_of_rates_;
  Angles wave_{};
  int rank_ = 1;
  bool are_spectral_ = false;
  std::vector<std::size_t> row_of_;  // of each term, among the states of the group
  std::vector<LinearForm> parts_;    // of each term, its contribution to that row
  std::vector<LinearForm> rows_;
  Eigen::MatrixXcd of_wave_;
  Eigen::VectorXd scales_;      // of states: they have units
  std::vector<Reach> reaches_;  // of these rows
};

}  // namespace dpde::stability
