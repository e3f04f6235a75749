// SPDX-License-Identifier: Apache-2.0
// UTF-8 functions for displaying text in a terminal.
#pragma once

#include <string>
#include <string_view>

namespace dpde {

/// The first character of a nonempty text.
struct Utf8Character {
  int bytes = 1;       ///< its length
  char32_t code = 0;   ///< its code point
  bool valid = false;  ///< false: one byte that is not UTF-8
};
Utf8Character first_character(std::string_view text);

/// Columns the character takes in a terminal: 0 (combining), 1 or 2 (wide).
int display_width(char32_t code);

/// False for control characters and characters that change the text direction.
bool is_printable(char32_t code);

/// `text` with '?' for everything that is not printable UTF-8; line breaks stay.
std::string printable(std::string_view text);

/// The same with '?' also for line breaks, so that it cannot end a comment in emitted code.
std::string printable_line(std::string_view text);

}  // namespace dpde
