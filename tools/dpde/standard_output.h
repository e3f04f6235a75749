// SPDX-License-Identifier: Apache-2.0
// Standard output where it is a pipe: its reader may be done before the command is, as `head` is.
#pragma once

#include <cstdio>

namespace dpde::tools {

/// Text that nobody reads any more is dropped without a word, and the command goes on: what it writes to files is
/// wanted all the same. Other errors are told as ever.
std::FILE* standard_output();

}  // namespace dpde::tools
