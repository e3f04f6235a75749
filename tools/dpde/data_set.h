// SPDX-License-Identifier: Apache-2.0
// dpde run for a data set: all its runs, in one file.
#pragma once

#include "command.h"

namespace dpde::tools {

/// Whether the name given to the job is that of a data set; the source must be loaded.
bool is_data_set(Job& job);

/// Finished runs are stored next to the final file, as FILE.0, FILE.1, ...; with `resume` they are reused.
Json make_data_set(Job& job, bool resume, bool quiet);

}  // namespace dpde::tools
