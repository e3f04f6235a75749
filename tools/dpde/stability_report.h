// SPDX-License-Identifier: Apache-2.0
// What commands say about a scene's verdict.
#pragma once

#include <string>

#include "stability/verdict.h"
#include "support/json.h"

namespace dpde::tools {

struct StabilityReport {
  Json json;         // the object `stability` of dpde check
  std::string text;  // one line or more
};
StabilityReport report_of(const model::Problem& problem, const stability::Verdict& verdict, const SourceFile& source);

}  // namespace dpde::tools
