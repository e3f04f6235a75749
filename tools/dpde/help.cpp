// SPDX-License-Identifier: Apache-2.0
// dpde help: the options of a verb, the meaning of an error code, or what the manual says of a word.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "command.h"
#include "manual_search.h"
#include "source/diagnostic.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

/// For a terminal: without links and bold letters.
std::string without_marks(std::string text) {
  for (std::size_t at = text.find("**"); at != std::string::npos; at = text.find("**", at)) text.erase(at, 2);
  for (std::size_t middle = text.find("]("); middle != std::string::npos; middle = text.find("](")) {
    const std::size_t begin = text.rfind('[', middle), end = text.find(')', middle);
    if (begin == std::string::npos || end == std::string::npos) break;
    text.erase(middle, end - middle + 1);
    text.erase(begin, 1);
  }
  return text;
}

std::string indented(const std::string& text) {
  std::string result;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    result += "  " + text.substr(begin, end - begin) + "\n";
    begin = end + 1;
  }
  return result;
}

/// A long listing, as that of the grammar: its lines with the word.
std::string shortened(const std::string& text, const std::string& word) {
  constexpr std::ptrdiff_t longest = 16;
  if (std::ranges::count(text, '\n') <= longest) return text;
  std::string lines;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string line = text.substr(begin, end - begin);
    if (has_word(line, word)) lines += line + "\n";
    begin = end + 1;
  }
  return lines;
}

int refuse(const std::string& word, const Streams& streams) {
  const std::string nearest = nearest_name(word, words_of(manual_pages()));
  const std::string help = nearest.empty() ? "dpde help lists the verbs" : "did you mean " + nearest + "?";
  constexpr std::size_t longest = 60;
  const std::string shown = word.size() > longest ? word.substr(0, longest) + "..." : word;
  fmt::print(streams.err, "dpde: error[E0904]: the manual has no word {}\n  help: {}\n", shown, help);
  return static_cast<int>(Exit::wrong_input);
}

int search(const std::string& word, const Streams& streams) {
  constexpr std::size_t most_blocks = 8;
  const std::vector<ManualBlock> blocks = blocks_with(word, manual_pages());
  if (blocks.empty()) return refuse(word, streams);
  std::string place, table;
  for (std::size_t i = 0; i < std::min(blocks.size(), most_blocks); ++i) {
    const std::string here = blocks[i].page + ", " + without_marks(blocks[i].heading);
    if (here != place) fmt::print(streams.out, "{}{}\n", i == 0 ? "" : "\n", here);
    const bool is_other_table = here != place || blocks[i].table != table;
    place = here;
    table = blocks[i].table;
    fmt::print(streams.out, "{}",
               indented(without_marks((is_other_table ? table : "") + shortened(blocks[i].text, word))));
  }
  std::set<std::string> pages;
  for (std::size_t i = most_blocks; i < blocks.size(); ++i) pages.insert(blocks[i].page);
  if (!pages.empty())
    fmt::print(streams.out, "\n{} more places, in {}\n", blocks.size() - most_blocks, fmt::join(pages, ", "));
  return flushed(static_cast<int>(Exit::done), streams);
}

std::string upper(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

/// E0301 or w0510.
bool is_code(const std::string& word) {
  const std::string code = upper(word);
  const auto is_digit = [](unsigned char c) { return std::isdigit(c) != 0; };
  return code.size() == 5 && (code[0] == 'E' || code[0] == 'W') && std::all_of(code.begin() + 1, code.end(), is_digit);
}

int help(const CLI::App& app, const std::string& word, const Streams& streams) {
  const auto verbs = app.get_subcommands(nullptr);
  const auto verb = std::ranges::find(verbs, word, [](const CLI::App* one) { return one->get_name(); });
  if (word.empty() || verb != verbs.end()) {
    const std::string all = app.get_formatter()->make_help(&app, app.get_name(), CLI::AppFormatMode::Normal);
    fmt::print(streams.out, "{}", word.empty() ? all : (*verb)->help(app.get_name()));
    return flushed(static_cast<int>(Exit::done), streams);
  }
  return is_code(word) ? explain(upper(word), streams) : search(word, streams);
}

}  // namespace

void add_help(CLI::App& app, Console& console) {
  const auto word = std::make_shared<std::string>();
  CLI::App* verb = app.add_subcommand("help", "what the manual says of a word, an error code or a verb");
  verb->add_option("word", *word, "a word of the language, of a command or of the field")->type_name("WORD");
  verb->footer("Examples:\n  dpde help upwind\n  dpde help run\n  dpde help E0301\n  dpde help --set");
  on_call(*verb, console, [word, &app, &console] { return help(app, *word, console.streams); });
}

}  // namespace dpde::tools
