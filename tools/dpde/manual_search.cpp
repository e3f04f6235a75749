// SPDX-License-Identifier: Apache-2.0
#include "manual_search.h"

#include <algorithm>
#include <cctype>
#include <set>
#include <sstream>
#include <utility>

namespace dpde::tools {

namespace {

bool is_of_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

}  // namespace

/// As a whole word: `rk2` is not in `ssp_rk2`. A word that begins or ends with a sign, as --set, may touch letters
/// there.
bool has_word(std::string_view text, const std::string& any) {
  const std::string in = lower(text), word = lower(any);
  if (word.find_first_not_of(' ') == std::string::npos) return false;
  for (std::size_t at = in.find(word); at != std::string::npos; at = in.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    const bool begins = at == 0 || !is_of_word(word.front()) || !is_of_word(in[at - 1]);
    const bool ends = end == in.size() || !is_of_word(word.back()) || !is_of_word(in[end]);
    if (begins && ends) return true;
  }
  return false;
}

namespace {

/// Splits a page into blocks. Comments of Markdown are for the tests of the page.
class PageReader {
 public:
  explicit PageReader(const ManualPage& page) : page_(page.name), lines_(std::string(page.text)) {}

  std::vector<ManualBlock> blocks() {
    for (std::string line; std::getline(lines_, line);) take(line);
    finish();
    return std::move(blocks_);
  }

 private:
  void take(const std::string& line) {
    if (is_comment_ || line.starts_with("<!--")) {
      is_comment_ = line.find("-->") == std::string::npos;
      return finish();
    }
    const bool is_fence = line.find("```") == line.find_first_not_of(' ') && line.find("```") != std::string::npos;
    if (is_fence) {
      if (!is_listing_) finish();
      is_listing_ = !is_listing_;
      if (!is_listing_) finish();
      return;
    }
    if (is_listing_) return add(line);
    if (line.starts_with("#")) {
      finish();
      heading_ = line.substr(line.find_first_not_of("# "));
      return;
    }
    const std::size_t begin = line.find_first_not_of(' ');
    if (begin == std::string::npos) {
      finish();
      table_.clear();
      return;
    }
    const bool is_row = line[begin] == '|';
    if (is_row || line.compare(begin, 2, "- ") == 0) finish();
    if (line.starts_with("|--")) return;
    if (is_row && table_.empty()) {
      table_ = line + "\n";
      return;
    }
    if (!is_row) table_.clear();
    add(line);
  }
  void add(const std::string& line) { text_ += line + "\n"; }
  void finish() {
    if (!text_.empty()) blocks_.push_back({page_, heading_, std::exchange(text_, ""), table_});
  }

  std::string page_;
  std::istringstream lines_;
  std::vector<ManualBlock> blocks_;
  std::string heading_, text_, table_;
  bool is_listing_ = false, is_comment_ = false;
};

/// Text between signs of code.
std::vector<std::string> code_in(const std::string& text) {
  std::vector<std::string> code;
  for (std::size_t begin = text.find('`'); begin != std::string::npos; begin = text.find('`', begin)) {
    const std::size_t end = text.find('`', begin + 1);
    if (end == std::string::npos) break;
    code.push_back(text.substr(begin + 1, end - begin - 1));
    begin = end + 1;
  }
  return code;
}

/// 0 is best; see blocks_with.
int rank_of(const ManualBlock& block, const std::string& word) {
  const std::string first = block.text.substr(0, block.text.find('|', 1));
  const bool is_row = block.text.starts_with("|");
  if (is_row && has_word(first, word)) return 0;
  if (has_word(block.heading, word)) return 1;
  const auto has = [&](const std::string& code) { return has_word(code, word); };
  return std::ranges::any_of(code_in(block.text), has) ? 2 : 3;
}

}  // namespace

std::vector<ManualBlock> blocks_with(const std::string& word, const std::vector<ManualPage>& pages) {
  std::vector<std::pair<int, ManualBlock>> ranked;
  for (const ManualPage& page : pages) {
    constexpr int after_all = 10;
    const int rank = page.is_of_changes ? after_all : 0;
    for (ManualBlock& block : PageReader(page).blocks()) {
      if (has_word(block.text, word)) ranked.emplace_back(rank + rank_of(block, word), std::move(block));
    }
  }
  std::ranges::stable_sort(ranked, {}, &std::pair<int, ManualBlock>::first);
  std::vector<ManualBlock> blocks;
  for (auto& [rank, block] : ranked) blocks.push_back(std::move(block));
  return blocks;
}

std::vector<std::string> words_of(const std::vector<ManualPage>& pages) {
  std::set<std::string> words;
  for (const ManualPage& page : pages) {
    for (const std::string& code : code_in(std::string(page.text))) {
      const std::string word = code.substr(0, code.find_first_of("( "));
      if (!word.empty() && std::ranges::all_of(word, [](char c) { return is_of_word(c) || c == '-'; }))
        words.insert(word);
    }
  }
  return {words.begin(), words.end()};
}

}  // namespace dpde::tools
