// SPDX-License-Identifier: Apache-2.0
// The text of the headers that emitted code includes. They travel inside the compiler: nothing has to be found where it
// was built or installed.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace dpde::codegen {

struct HeaderText {
  std::string_view name;  // "kernel_abi.h"
  std::string_view text;
};
extern const HeaderText abi_headers[5];  // abi_texts.cpp.in, filled in by CMake

/// Writes folder/dpde/<name> for each; false when that fails.
bool write_abi_headers(const std::filesystem::path& folder);
/// All of them, one after the other: what is compiled with them depends on it.
std::string abi_header_texts();

}  // namespace dpde::codegen
