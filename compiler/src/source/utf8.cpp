// SPDX-License-Identifier: Apache-2.0
// Decodes by the table of well-formed sequences (Unicode 15, table 3-7): no overlong forms, no surrogates.
#include "source/utf8.h"

#include <algorithm>

namespace dpde {
namespace {

unsigned byte_at(std::string_view text, std::size_t i) { return static_cast<unsigned char>(text[i]); }

bool is_continuation(std::string_view text, std::size_t i) {
  return i < text.size() && (byte_at(text, i) & 0xC0u) == 0x80u;
}

bool is_between(char32_t code, char32_t low, char32_t high) { return code >= low && code <= high; }

}  // namespace

Utf8Character first_character(std::string_view text) {
  const unsigned lead = byte_at(text, 0);
  if (lead < 0x80) return {1, static_cast<char32_t>(lead), true};
  const int bytes = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4) return {};
  char32_t code = lead & (0x7Fu >> bytes);
  for (int i = 1; i < bytes; ++i) {
    if (!is_continuation(text, i)) return {};
    code = (code << 6) | (byte_at(text, i) & 0x3Fu);
  }
  const bool overlong = (bytes == 3 && code < 0x800) || (bytes == 4 && code < 0x10000);
  if (overlong || is_between(code, 0xD800, 0xDFFF) || code > 0x10FFFF) return {};
  return {bytes, code, true};
}

int display_width(char32_t code) {
  if (is_between(code, 0x300, 0x36F) || code == 0x200B || is_between(code, 0x20D0, 0x20FF)) return 0;
  const bool wide = is_between(code, 0x1100, 0x115F) || is_between(code, 0x2E80, 0xA4CF) ||
                    is_between(code, 0xAC00, 0xD7A3) || is_between(code, 0xF900, 0xFAFF) ||
                    is_between(code, 0xFE30, 0xFE6F) || is_between(code, 0xFF00, 0xFF60) ||
                    is_between(code, 0x1F300, 0x1FAFF) || is_between(code, 0x20000, 0x3FFFD);
  return wide ? 2 : 1;
}

bool is_printable(char32_t code) {
  if (code < 0x20 || is_between(code, 0x7F, 0x9F)) return false;
  return !is_between(code, 0x200B, 0x200F) && !is_between(code, 0x2028, 0x202E) && !is_between(code, 0x2066, 0x2069) &&
         code != 0xFEFF;
}

std::string printable(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const Utf8Character character = first_character(text);
    const bool shown = character.valid && (is_printable(character.code) || character.code == '\n');
    result += shown ? text.substr(0, character.bytes) : std::string_view("?");
    text.remove_prefix(character.bytes);
  }
  return result;
}

std::string printable_line(std::string_view text) {
  std::string line = printable(text);
  std::ranges::replace(line, '\n', '?');
  return line;
}

}  // namespace dpde
