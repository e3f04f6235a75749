// SPDX-License-Identifier: Apache-2.0
#include "codegen/cpp/abi_headers.h"

#include <fstream>

namespace dpde::codegen {

bool write_abi_headers(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder / "dpde", error);
  for (const HeaderText& header : abi_headers) {
    std::ofstream out(folder / "dpde" / header.name);
    out << header.text;
    if (!out.flush()) return false;
  }
  return true;
}

std::string abi_header_texts() {
  std::string texts;
  for (const HeaderText& header : abi_headers) texts += header.text;
  return texts;
}

}  // namespace dpde::codegen
