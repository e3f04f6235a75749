// SPDX-License-Identifier: Apache-2.0
// Standard output for pipes whose reader may end before the command does, such as `head`.
#pragma once

#include <cstdio>

namespace dpde::tools {

/// If the reader has ended, further text is dropped silently and the command continues: its files are still wanted.
/// Other errors are reported as usual.
std::FILE* standard_output();

}  // namespace dpde::tools
