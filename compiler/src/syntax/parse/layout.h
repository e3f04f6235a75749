// SPDX-License-Identifier: Apache-2.0
// Layout of the source text, kept for `dpde fmt`.
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

/// Layout of { ... }.
struct BlockLayout {
  std::vector<std::string> before;            // comments between the first word and {
  std::string after;                          // comment after {
  std::vector<std::string> closing_comments;  // whole-line comments above }
  bool one_line = false;
};

}  // namespace dpde::ast
