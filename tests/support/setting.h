// SPDX-License-Identifier: Apache-2.0
// Settings of tests from the environment.
#pragma once

#include <cstdint>
#include <cstdlib>

namespace dpde::testing {

inline std::uint64_t setting(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text ? std::strtoull(text, nullptr, 10) : otherwise;
}

/// Whether tests run all of their cases (DPDE_THOROUGH=1, as the nightly run does) or a selection.
inline bool is_thorough() { return setting("DPDE_THOROUGH", 0) != 0; }

/// Whether case number `count` runs: all at night, every `every`-th by day.
inline bool is_tried(std::size_t count, std::size_t every) { return is_thorough() || count % every == 0; }

}  // namespace dpde::testing
