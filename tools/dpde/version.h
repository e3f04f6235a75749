// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace dpde::tools {

/// In lines: version, commit, LLVM, and the processor that this runs on.
std::string version_text();

}  // namespace dpde::tools
