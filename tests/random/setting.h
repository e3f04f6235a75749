// SPDX-License-Identifier: Apache-2.0
// Numbers of tests that the environment changes.
#pragma once

#include <cstdint>
#include <cstdlib>

namespace dpde::testing {

inline std::uint64_t setting(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text ? std::strtoull(text, nullptr, 10) : otherwise;
}

}  // namespace dpde::testing
