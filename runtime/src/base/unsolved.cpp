// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/unsolved.h"

#include <fmt/format.h>

#include <cmath>

namespace dpde {

void Unsolved::set_place(int step, int steps, double t) {
  if (!std::isnan(facts_.t)) return;
  facts_.step = step;
  facts_.steps = steps;
  facts_.t = t;
  const std::string where =
      step > 0 ? fmt::format("step {} of {} (t = {:.6g})", step, steps, t) : fmt::format("at t = {:.6g}", t);
  explain(fmt::format("{}: {}", where, facts_.text), messages());
}

}  // namespace dpde
