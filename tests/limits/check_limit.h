// SPDX-License-Identifier: Apache-2.0
// Compares the verdict on a scene's step with runs of that step.
#pragma once

#include <string>

namespace dpde::testing {

struct LimitCheck {
  enum class Kind {
    agrees,         // with runs at 0.97 and 1.04 of the limit; without a limit, with runs of other step lengths
    near_estimate,  // an estimate that agrees
    estimate,       // an estimate that does not agree: see `ratio`
    too_high,       // an exact limit, but a shorter step grows
    too_low,        // an exact limit, but a longer step does not grow
    unclear,        // rounding hides the result of runs
    refused,        // by the compiler
    not_analysed
  };
  Kind kind = Kind::agrees;
  double ratio = 1;    // limit by runs / estimated limit, one of a few tried ratios
  std::string detail;  // the verdict, and the result of runs
};

std::string name_of(LimitCheck::Kind kind);

/// Checks the scene `s` of the text.
LimitCheck check_limit(const std::string& text);

}  // namespace dpde::testing
