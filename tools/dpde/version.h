// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace dpde::tools {

/// Lines with version, commit, LLVM, and the processor in use.
std::string version_text();

}  // namespace dpde::tools
