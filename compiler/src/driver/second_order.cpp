// SPDX-License-Identifier: Apache-2.0
#include "driver/second_order.h"

#include <algorithm>
#include <cmath>

namespace dpde::driver {

std::unique_ptr<SecondOrder> SecondOrder::open(Session& session, Inverse& inverse, Curvature curvature) {
  std::unique_ptr<Rollout> rollout = session.second_order_rollout(curvature == Curvature::gauss_newton);
  if (!rollout) return nullptr;
  return std::unique_ptr<SecondOrder>(new SecondOrder(session, inverse, curvature, std::move(rollout)));
}

std::string SecondOrder::variable(const std::string& name) const {
  return curvature_ == Curvature::full ? name : name + "_dot";
}

FieldView SecondOrder::field_bar(const std::string& name) const {
  const int state = rollout_->state_index(name);
  if (state >= 0) return last_->state_bars[static_cast<std::size_t>(state)];
  const std::vector<std::string>& sought = rollout_->sought();
  const auto found = std::find(sought.begin(), sought.end(), name);
  return found == sought.end() ? FieldView{} : last_->field_bars[static_cast<std::size_t>(found - sought.begin())];
}

void SecondOrder::product(const Eigen::VectorXd& x, const Eigen::VectorXd& v, Eigen::VectorXd& result) {
  directions_.assign(x, v);
  directions_.start(*rollout_);
  last_ = &rollout_->gradient();
  if (last_->stopped) {
    result.setConstant(NAN);
    return;
  }
  const std::vector<std::string>& params = rollout_->param_bar_names();
  for (const Inverse::Part& part : inverse_.parts()) {
    if (part.is_field()) {
      const std::size_t size = static_cast<std::size_t>(part.size);
      copy_out(field_bar(variable(part.name)), {result.data() + part.offset, size});
      continue;
    }
    const auto bar = std::find(params.begin(), params.end(), variable(part.name));
    if (part.is_control()) {
      auto values = result.segment(part.offset, part.size);
      values.setZero();
      const auto number = static_cast<std::size_t>(bar - params.begin());
      if (bar != params.end()) values = Eigen::Map<const Eigen::VectorXd>(last_->control_bars[number].data(), part.size);
      continue;
    }
    result[part.offset] = bar == params.end() ? 0 : last_->param_bars[static_cast<std::size_t>(bar - params.begin())];
  }
  for (const std::string& program : session_.compiled().formula_programs()) add_through_formula(program, result);
}

/// What the unknown parameters of a formula contribute through its fields.
void SecondOrder::add_through_formula(const std::string& formula, Eigen::VectorXd& result) {
  const auto derived = session_.compiled().derived.find(formula);
  if (derived == session_.compiled().derived.end() || !derived->second.second) return;
  const adjoint::Derivative& second = *derived->second.second;
  Workspace& workspace = session_.workspace();
  for (const std::string& kept : session_.compiled().stencil.find_program(formula)->keeps) {
    const bool is_unknown =
        std::ranges::any_of(inverse_.parts(), [&](const Inverse::Part& p) { return p.is_field() && p.name == kept; });
    for (const std::string& name : {kept, directions_.dot_of(formula, kept)}) {
      const auto bar_name = second.names.find(name);
      if (bar_name == second.names.end()) continue;
      const FieldView bar = field_bar(name);
      Field& field = workspace.field(bar_name->second);
      field.fill(0);
      // Gauss-Newton leaves the formulas' own second derivatives out, too: only the seeds of rates count.
      const bool counts = curvature_ == Curvature::full || name != kept;
      if (is_unknown || bar.base == nullptr || !counts) continue;
      copy_interior(workspace.layout(), field.base(), bar);
    }
  }
  const auto sums = workspace.run(*session_.compiled().program(second.program), session_.problem().t_begin);
  for (const Inverse::Part& part : inverse_.parts()) {
    if (part.is_field() || part.is_control()) continue;
    const auto bar = second.names.find(variable(part.name));
    const auto sum = bar == second.names.end() ? sums.end() : sums.find(bar->second);
    if (sum != sums.end()) result[part.offset] += sum->second;
  }
}

}  // namespace dpde::driver
