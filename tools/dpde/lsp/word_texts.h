// SPDX-License-Identifier: Apache-2.0
// Texts of editors for the words of the language: syntax, and the meaning in a sentence.
#pragma once

#include <string_view>

namespace dpde::lsp {

struct WordText {
  std::string_view word, usage, text;
};

/// nullptr if there is none.
const WordText* text_of_function(std::string_view word);
/// For the first word of a line; `block` is model, scene, ...
const WordText* text_of_line(std::string_view block, std::string_view word);
const WordText* text_of_block(std::string_view word);
/// For a key of a scheme.
const WordText* text_of_key(std::string_view key);
/// The key that sets the discretisation of a function; "" if none does.
std::string_view key_of_function(std::string_view word);

}  // namespace dpde::lsp
