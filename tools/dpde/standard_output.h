// SPDX-License-Identifier: Apache-2.0
// Standard output where it is a pipe: its reader may be done before the command is, as `head` is.
#pragma once

namespace dpde::tools {

/// From now on text that nobody reads any more is dropped without a word, and the command goes on: what it writes to
/// files is wanted all the same. Other errors are told as ever.
void drop_what_nobody_reads();

}  // namespace dpde::tools
