// SPDX-License-Identifier: Apache-2.0
#include "files/read_file.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "dpde/runtime/error.h"

namespace dpde {

std::string read_file(const std::filesystem::path& path) {
  const auto fail = [&](std::string_view why) {
    throw Error(ErrorKind::input, fmt::format("cannot read {}: {}", path.string(), why));
  };
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) fail("it is a folder");
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(std::strerror(errno));
  const auto size = std::filesystem::file_size(path, error);
  if (error) fail("it is not a regular file");
  std::string bytes(size, '\0');
  if (!file.read(bytes.data(), static_cast<std::streamsize>(size))) fail("it is shorter than it says");
  return bytes;
}

}  // namespace dpde
