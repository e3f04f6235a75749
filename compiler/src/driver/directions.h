// SPDX-License-Identifier: Apache-2.0
// A direction in the space of a task's unknowns, as the tangent programs want it: rates of parameters, coefficients and
// initial states, those that come through formulas included.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "driver/inverse.h"

namespace dpde::driver {

class Directions {
 public:
  Directions(Session& session, Inverse& inverse) : session_(session), inverse_(inverse) {}

  /// Makes the session start from x and sets the rates in the direction d.
  void assign(const Eigen::VectorXd& x, const Eigen::VectorXd& d);
  /// Makes a rollout of the step's tangent start from there: states, rates and parameters.
  void start(Rollout& rollout) const;
  /// What the tangent of a program calls the rate of `name`; "" when it has none.
  std::string dot_of(const std::string& primal, adjoint::Link::Kind kind, const std::string& name) const;
  /// Rates of the states at the start, by state.
  const std::map<std::string, std::vector<double>>& state_rates() const { return state_rates_; }

 private:
  void run_formulas(const Eigen::VectorXd& x, const Eigen::VectorXd& d);

  Session& session_;
  Inverse& inverse_;
  std::map<std::string, std::vector<double>> state_rates_;
};

}  // namespace dpde::driver
