// SPDX-License-Identifier: Apache-2.0
#include "driver/second_order.h"

#include <cmath>

namespace dpde::driver {

std::unique_ptr<SecondOrder> SecondOrder::open(Session& session, Inverse& inverse, Curvature curvature) {
  std::unique_ptr<Rollout> rollout = session.second_order_rollout(curvature == Curvature::gauss_newton);
  if (!rollout) return nullptr;
  std::unique_ptr<SecondOrder> result(new SecondOrder(session, inverse, curvature, std::move(rollout)));
  for (const std::string& formula : session.compiled().formula_programs()) {
    const auto derived = session.compiled().derived.find(formula);
    if (derived == session.compiled().derived.end()) continue;
    if (!derived->second.second) return nullptr;
    result->formulas_.push_back(session.compiled().program(derived->second.second->program));
  }
  return result;
}

void SecondOrder::product(const Eigen::VectorXd& x, const Eigen::VectorXd& v, Eigen::VectorXd& result) {
  directions_.assign(x, v);
  directions_.start(*rollout_);
  if (rollout_->gradient().stopped) {
    result.setConstant(NAN);
    return;
  }
  const bool of_rates = curvature_ == Curvature::gauss_newton;
  inverse_.copy_bars(*rollout_, of_rates, result);
  for (const dpde_program* formula : formulas_) inverse_.add_through_formula(*rollout_, *formula, of_rates, result);
}

}  // namespace dpde::driver
