// SPDX-License-Identifier: Apache-2.0
// Internal errors: conditions that no user input can cause.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <source_location>

namespace dpde {

/// Reports a broken invariant of the compiler and aborts. Not for user errors, which are diagnostics.
[[noreturn]] inline void unreachable(const char* what, std::source_location at = std::source_location::current()) {
  std::fprintf(stderr, "dpde: internal error: %s (%s:%u)\n", what, at.file_name(), at.line());
  std::abort();
}

inline void require(bool condition, const char* what, std::source_location at = std::source_location::current()) {
  if (!condition) unreachable(what, at);
}

}  // namespace dpde
