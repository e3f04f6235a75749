// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace dpde::files {

/// Content of a file that only this user can have written: no link, owned by this user, and not writable by its group
/// or others. It is opened once, and checked through the open descriptor.
std::optional<std::string> read_private_file(const std::filesystem::path& path);

}  // namespace dpde::files
