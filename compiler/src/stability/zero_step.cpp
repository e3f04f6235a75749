// SPDX-License-Identifier: Apache-2.0
#include "stability/zero_step.h"

#include <algorithm>
#include <cmath>

#include "dpde/runtime/error.h"

namespace dpde::stability {

namespace {

/// While it lives dt is 0, whatever is thrown.
class WithoutStep {
 public:
  explicit WithoutStep(Workspace& workspace) : workspace_(workspace), dt_(workspace.params().at("dt")) {
    workspace_.set_param("dt", 0);
  }
  ~WithoutStep() { workspace_.set_param("dt", dt_); }
  WithoutStep(const WithoutStep&) = delete;
  WithoutStep& operator=(const WithoutStep&) = delete;

 private:
  Workspace& workspace_;
  double dt_;
};

}  // namespace

std::map<std::string, std::vector<double>> after_step_of_no_length(driver::Session& session,
                                                                   const std::vector<std::string>& fields, double t) {
  Workspace& workspace = session.workspace();
  const dpde_program& step = *session.compiled().program(session.compiled().step_name());
  Workspace::Bound bound;
  for (int s = 0; s < session.rollout().state_count(); ++s)
    bound[session.rollout().state_name(s)] = session.rollout().initial(s).base();
  std::map<std::string, std::vector<double>> result;
  try {
    const WithoutStep without_step(workspace);
    workspace.execute(step, t, bound);
    for (const std::string& field : fields) result[field] = workspace.dense(field);
  } catch (const Error&) {
    result.clear();  // as of an operator that is divided by dt
  }
  workspace.release(step);
  // As of a right side that is divided by dt.
  const auto is_finite = [](double value) { return std::isfinite(value); };
  std::erase_if(result, [&](const auto& entry) { return !std::ranges::all_of(entry.second, is_finite); });
  return result;
}

}  // namespace dpde::stability
