// SPDX-License-Identifier: Apache-2.0
// How a person laid out what was read, kept for `dpde fmt`.
#pragma once

#include <string>
#include <vector>

namespace dpde::ast {

/// Comments around an item, so that `dpde fmt` loses nothing.
struct Trivia {
  std::vector<std::string> before;  // whole-line comments above, each with its #; "" is a blank line below a comment
  std::string after;                // comment at the end of the same line, with its #
  bool blank_before = false;        // one blank line stood above
};

/// How { ... } was written.
struct BlockLayout {
  std::vector<std::string> before;            // comments between the first word and {
  std::string after;                          // comment behind {
  std::vector<std::string> closing_comments;  // whole-line comments above }
  bool one_line = false;
};

}  // namespace dpde::ast
