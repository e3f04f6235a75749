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

/// Whether each test takes all of its cases (DPDE_THOROUGH=1, as the nightly run does) or some of them.
inline bool is_thorough() { return setting("DPDE_THOROUGH", 0) != 0; }

/// Whether case number `count` of many is one of those that are tried: all at night, each `every`th by day.
inline bool is_tried(std::size_t count, std::size_t every) { return is_thorough() || count % every == 0; }

}  // namespace dpde::testing
