// SPDX-License-Identifier: Apache-2.0
// A folder of --out that several scenes share. A file named after a field or a table, such as u.npy, belongs to the
// last scene; those of other scenes get the scene's name as a prefix, rod_u.npy. DIR/.dpde records the owners.
#pragma once

#include <filesystem>

#include "command.h"

namespace dpde::tools {

/// Call before writing `file` in the folder of --out.
void keep_file_of_others(Job& job, const std::filesystem::path& file);

}  // namespace dpde::tools
