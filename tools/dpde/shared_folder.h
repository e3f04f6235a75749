// SPDX-License-Identifier: Apache-2.0
// A folder of --out that several scenes share. What is called after a field or a table, u.npy, is of the last of them;
// those of others get their scene's name in front, rod_u.npy. DIR/.dpde says whose each is.
#pragma once

#include <filesystem>

#include "command.h"

namespace dpde::tools {

/// Before `file`, in the folder of --out, is written.
void keep_file_of_others(Job& job, const std::filesystem::path& file);

}  // namespace dpde::tools
