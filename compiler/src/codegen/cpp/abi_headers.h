// SPDX-License-Identifier: Apache-2.0
// Text of the headers that emitted code includes. It is embedded in the compiler, so no installed files are needed.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace dpde::codegen {

struct HeaderText {
  std::string_view name;  // e.g. "kernel_abi.h"
  std::string_view text;
};
extern const HeaderText abi_headers[5];  // abi_texts.cpp.in, filled in by CMake

/// Writes each header to folder/dpde/<name>. Returns false on failure.
bool write_abi_headers(const std::filesystem::path& folder);
/// All headers concatenated; part of the cache key of code compiled with them.
std::string abi_header_texts();

}  // namespace dpde::codegen
