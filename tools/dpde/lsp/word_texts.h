// SPDX-License-Identifier: Apache-2.0
// What editors show of the language's words: how each is written, and in a sentence what it says.
#pragma once

#include <string_view>

namespace dpde::lsp {

struct WordText {
  std::string_view word, usage, text;
};

/// nullptr where there is none.
const WordText* text_of_function(std::string_view word);
/// Of the first word of a line; `block` is model, scene, ...
const WordText* text_of_line(std::string_view block, std::string_view word);
const WordText* text_of_block(std::string_view word);
/// Of a key of a scheme.
const WordText* text_of_key(std::string_view key);
/// The key that says how a function is discretised; "" where none does.
std::string_view key_of_function(std::string_view word);

}  // namespace dpde::lsp
