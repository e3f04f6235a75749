// SPDX-License-Identifier: Apache-2.0
#include "analysis/run/instability.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "driver/report/blow_up.h"

namespace dpde::analysis {

std::string instability(driver::Session& session) {
  constexpr double disturbance = 1e-6;  // relative to the largest value: a uniform start excites no unstable mode
  Rollout& rollout = session.rollout();
  const auto blow_up_of = [&](const RunResult& done) {
    return fmt::format("{} is no longer finite after step {} of {}", rollout.state_name(done.blow_up->state),
                       done.blow_up->step, session.steps());
  };
  const RunResult own = rollout.run();
  if (own.blow_up) return blow_up_of(own);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int s = 0; s < rollout.state_count(); ++s) {
    std::vector<double> values = session.initial(s);
    double largest = 0;
    for (const double value : values) largest = std::max(largest, std::abs(value));
    for (double& value : values) value += disturbance * (largest > 0 ? largest : 1) * uniform(random);
    rollout.initial(s).copy_in(values);
  }
  const RunResult done = rollout.run();
  if (done.blow_up) return fmt::format("a millionth more at the start and {}", blow_up_of(done));
  const std::vector<dpde::Growth> growths = driver::instabilities_of(session);
  return growths.empty()
             ? ""
             : fmt::format("{} grows from {:.3g} to {:.3g}", growths[0].state, growths[0].before, growths[0].after);
}

}  // namespace dpde::analysis
