// SPDX-License-Identifier: Apache-2.0
// UTF-8, as much of it as showing text in a terminal needs.
#pragma once

#include <string>
#include <string_view>

namespace dpde {

/// The first character of a text that is not empty.
struct Utf8Character {
  int bytes = 1;       ///< how many bytes it takes
  char32_t code = 0;   ///< its code point
  bool valid = false;  ///< false: one byte that is no UTF-8
};
Utf8Character first_character(std::string_view text);

/// Columns the character takes in a terminal: 0 (combining), 1 or 2 (wide).
int display_width(char32_t code);

/// False for control characters, and for those that change the direction of the text around them.
bool is_printable(char32_t code);

/// `text` with '?' for everything that is no printable UTF-8; line breaks stay.
std::string printable(std::string_view text);

/// The same with '?' for line breaks too: a comment of emitted code that holds it ends where it should.
std::string printable_line(std::string_view text);

}  // namespace dpde
