// SPDX-License-Identifier: Apache-2.0
// A whole file as bytes. Inside the runtime only.
#pragma once

#include <filesystem>
#include <string>

namespace dpde {

/// @throws Error(input) naming the file and the operating system's reason.
std::string read_file(const std::filesystem::path& path);

}  // namespace dpde
