// SPDX-License-Identifier: Apache-2.0
// Programmer errors: conditions no input of a user can bring about.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <source_location>

namespace dpde {

/// Reports a broken invariant of the compiler and aborts. User errors are diagnostics, never this.
[[noreturn]] inline void unreachable(const char* what, std::source_location at = std::source_location::current()) {
  std::fprintf(stderr, "dpde: internal error: %s (%s:%u)\n", what, at.file_name(), at.line());
  std::abort();
}

inline void require(bool condition, const char* what, std::source_location at = std::source_location::current()) {
  if (!condition) unreachable(what, at);
}

}  // namespace dpde
