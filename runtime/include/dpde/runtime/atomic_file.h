// SPDX-License-Identifier: Apache-2.0
// Files that are either complete or absent: written under a temporary name in the same folder, synced, renamed.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string_view>

namespace dpde {

/// Writes the parts one after the other. When anything fails the temporary file is removed and a file that was there
/// before under `path` is untouched. The folder must exist. An existing special file (a device, a pipe) is written
/// directly.
/// @throws Error(machine) naming the file and the operating system's reason.
void write_file_atomically(const std::filesystem::path& path, std::initializer_list<std::string_view> parts);
/// The same of a file that nobody but its owner may read or write, whoever could before.
void write_private_file_atomically(const std::filesystem::path& path, std::initializer_list<std::string_view> parts);
void write_file_atomically(const std::filesystem::path& path, std::string_view content);

}  // namespace dpde
