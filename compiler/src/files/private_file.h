// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace dpde::files {

/// The bytes of a file that nobody but this user can have written: it is no link, this user's, and neither its group
/// nor others may write to it. It is opened once, and looked at as it is open.
std::optional<std::string> read_private_file(const std::filesystem::path& path);

}  // namespace dpde::files
