// SPDX-License-Identifier: Apache-2.0
// Reading and writing files. A file gets its final name only when it is complete; every failure is a diagnostic.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "source/diagnostic.h"

namespace dpde::files {

/// Content of a regular file of at most 16 GiB. Reports cannot-read at `where`.
std::optional<std::string> read_file(const std::filesystem::path& path, SourceRange where, DiagnosticSink& sink);

/// See dpde/runtime/atomic_file.h. Reports machine-failed on failure, without leaving a file.
bool write_file(const std::filesystem::path& path, std::string_view bytes, DiagnosticSink& sink);

/// Creates the folder and its parents. Reports cannot-write.
bool make_folder(const std::filesystem::path& path, DiagnosticSink& sink);

/// `file` as named in a .dpde file: relative to the folder of `model_file`, or else to the current folder.
std::filesystem::path find_data_file(const std::string& file, const std::string& model_file);

}  // namespace dpde::files
