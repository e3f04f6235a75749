// SPDX-License-Identifier: Apache-2.0
// What commands say about a scene's verdict.
#pragma once

#include <string>

#include "json.h"
#include "stability/verdict.h"

namespace dpde::tools {

/// The object `stability` of dpde check.
Json stability_json(driver::Session& session, const stability::Verdict& verdict, const SourceFile& source);
/// One line or more.
std::string stability_text(driver::Session& session, const stability::Verdict& verdict, const SourceFile& source);

}  // namespace dpde::tools
