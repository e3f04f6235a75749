// SPDX-License-Identifier: Apache-2.0
// dpde run of a data set: all its runs, in one file.
#pragma once

#include "command.h"

namespace dpde::tools {

/// Whether the name that the job was given is that of a data set; its source is loaded.
bool is_data_set(Job& job);

/// Runs that are done lie beside the file that is to be made, as FILE.0, FILE.1, ...: with `resume` they are not made
/// again.
Json make_data_set(Job& job, bool resume, bool quiet);

}  // namespace dpde::tools
