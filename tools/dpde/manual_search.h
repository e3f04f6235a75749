// SPDX-License-Identifier: Apache-2.0
// The pages of the manual, and a search in them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace dpde::tools {

struct ManualPage {
  std::string_view name;  // schemes.md
  std::string_view text;  // Markdown
  bool is_of_changes = false;
};
/// Generated from dsl-examples/manual at configuration.
const std::vector<ManualPage>& manual_pages();

/// A paragraph, an item of a list, a row of a table or a listing, under its heading.
struct ManualBlock {
  std::string page, heading, text;
  std::string table = {};  // of a row: the names of the columns
};
/// Whether the text has the word, in capital or small letters, and not as a part of another word.
bool has_word(std::string_view text, const std::string& word);
/// All blocks with the word (letters may be of either case), those that describe it first: its heading or the first
/// column of a table has it, then listings and code, then other text; the page of changes
/// last.
std::vector<ManualBlock> blocks_with(const std::string& word, const std::vector<ManualPage>& pages);

/// Words of the language and of commands: all that the pages set as code.
std::vector<std::string> words_of(const std::vector<ManualPage>& pages);

}  // namespace dpde::tools
