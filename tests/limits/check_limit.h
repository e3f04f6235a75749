// SPDX-License-Identifier: Apache-2.0
// A verdict on the step of a scene, against runs of that step.
#pragma once

#include <string>

namespace dpde::testing {

struct LimitCheck {
  enum class Kind {
    agrees,         // with runs at 0.97 and 1.04 of the limit; where there is none, with runs of steps of other lengths
    near_estimate,  // so does an estimate
    estimate,       // it does not: see `ratio`
    too_high,       // it is said to be exact, and a shorter step grows
    too_low,        // likewise, and a longer one does not
    unclear,        // rounding hides what runs do
    refused,        // by the compiler
    not_analysed
  };
  Kind kind = Kind::agrees;
  double ratio = 1;    // the limit by runs over that of an estimate, one of a few
  std::string detail;  // the verdict, and what runs say
};

std::string name_of(LimitCheck::Kind kind);

/// Of the scene `s` of the text.
LimitCheck check_limit(const std::string& text);

}  // namespace dpde::testing
