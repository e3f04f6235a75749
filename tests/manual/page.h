// SPDX-License-Identifier: Apache-2.0
// A page of the manual as tests see it: its snippets, each with what the page says of it in comments that a reader does
// not see.
#pragma once

#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace dpde::testing {

/// A text between lines of ```. Comments before it:
///   <!-- as: TEXT -->                 what is run: TEXT with the snippet in the place of its @@
///   <!-- insert: FILE after: LINE --> what is run: FILE, from now on with the snippet behind its first line with LINE
///   <!-- replace: FILE line: LINE --> in the place of that line
///   <!-- append: FILE -->             at its end
///   <!-- quick: OPTIONS -->           commands get these too but in thorough tests; what they say is then not compared
///   <!-- shown: once -->              what commands print is that of one run, and not compared: choices by timings
///   <!-- status: 2 -->                what the commands of the snippet end with
struct Snippet {
  std::string language, name;  // ```dpde rod.dpde
  std::string text;
  std::string as, quick;
  std::string change, file, beside;  // insert, replace or append; of which file; the line
  bool is_compared = true;
  int status = 0;
  int line = 0;        // of its ```
  bool leads = false;  // stands before the first rules, the headings of the second level
};

inline std::vector<std::string> lines_of(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// Keeps what a comment says for the next snippet.
inline void read_comment(const std::string& comment, Snippet& next) {
  const auto rest = [&](const std::string& key) {
    std::string text = comment.substr(key.size());
    text.erase(0, text.find_first_not_of(" \n"));
    return text;
  };
  if (comment.starts_with("as:")) next.as = rest("as:");
  static const std::regex change(R"((insert|replace|append): (\S+)( (after|line): (.*))?)");
  std::smatch found;
  if (std::regex_match(comment, found, change)) {
    next.change = found[1];
    next.file = found[2];
    next.beside = found[5];
  }
  if (comment.starts_with("quick:")) next.quick = rest("quick:");
  if (comment == "shown: once") next.is_compared = false;
  if (comment.starts_with("status:")) next.status = std::stoi(rest("status:"));
}

inline std::vector<Snippet> snippets_of(const std::filesystem::path& page) {
  const std::vector<std::string> lines = lines_of(page);
  std::vector<Snippet> snippets;
  Snippet next;
  bool leads = true;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].starts_with("## ")) leads = false;
    if (lines[i].starts_with("<!-- ")) {
      std::string comment = lines[i].substr(5);
      while (comment.find("-->") == std::string::npos && i + 1 < lines.size()) comment += "\n" + lines[++i];
      comment.erase(comment.find("-->"));
      comment.erase(comment.find_last_not_of(" \n") + 1);
      read_comment(comment, next);
    }
    if (!lines[i].starts_with("```")) continue;
    const std::string head = lines[i].substr(3);
    next.language = head.substr(0, head.find(' '));
    next.name = head.find(' ') == std::string::npos ? "" : head.substr(head.find(' ') + 1);
    next.line = static_cast<int>(i) + 1;
    next.leads = leads;
    while (++i < lines.size() && !lines[i].starts_with("```")) next.text += lines[i] + "\n";
    snippets.push_back(next);
    next = {};
  }
  return snippets;
}

/// A command of a ```console snippet, and what the page says that it prints.
struct Command {
  std::string line;
  std::vector<std::string> prints;
};

inline std::vector<Command> commands_of(const Snippet& snippet) {
  std::vector<Command> commands;
  std::stringstream in(snippet.text);
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("$ "))
      commands.push_back({line.substr(2), {}});
    else if (!commands.empty())
      commands.back().prints.push_back(line);
  }
  return commands;
}

/// Whether a line is what the page shows, but for times, speeds and dates, rounding, and what stands as `...` there.
/// Numbers agree to 2 %, or are both below 1e-6.
inline bool is_shown(const std::string& shown, const std::string& printed) {
  static const std::regex part(R"((\.\.\.)|([-+]?\d+(\.\d+)?(e[-+]?\d+)? (ns|us|ms|s|[kMG]? ?points/s)(?![a-z]))|)"
                               R"((\d{4}-\d\d-\d\d( \d\d:\d\d)?)|([-+]?\d+(\.\d+)?(e[-+]?\d+)?)|(\s+))");
  std::string pattern;
  std::vector<double> numbers;
  auto from = shown.begin();
  const auto literally = [&](auto to) {
    for (; from != to; ++from)
      pattern += std::string(std::ispunct(static_cast<unsigned char>(*from)) ? "\\" : "") + *from;
  };
  for (auto match = std::sregex_iterator(shown.begin(), shown.end(), part); match != std::sregex_iterator(); ++match) {
    literally((*match)[0].first);
    if ((*match)[1].matched)
      pattern += ".*";
    else if ((*match)[2].matched)
      pattern += R"([-+]?[\d.]+(?:e[-+]?\d+)? (?:ns|us|ms|s|[kMG]? ?points/s))";
    else if ((*match)[6].matched)
      pattern += R"([-\d]+(?: [\d:]+)?)";
    else if ((*match)[8].matched) {
      pattern += R"(([-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?))";
      numbers.push_back(std::stod((*match)[8].str()));
    } else
      pattern += R"(\s+)";
    from = (*match)[0].second;
  }
  literally(shown.end());
  std::smatch found;
  if (!std::regex_match(printed, found, std::regex(pattern + R"(\s*)"))) return false;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const double other = std::stod(found[i + 1].str());
    const bool tiny = std::abs(numbers[i]) < 1e-6 && std::abs(other) < 1e-6;
    if (!tiny && std::abs(numbers[i] - other) > 0.02 * std::abs(numbers[i])) return false;
  }
  return true;
}

/// A line `...` stands for any lines. Empty: as shown; else the first line that is missing.
inline std::string missing_line(const std::vector<std::string>& shown, const std::vector<std::string>& printed) {
  std::size_t at = 0;
  bool any = false;
  for (const std::string& line : shown) {
    if (line == "...") {
      any = true;
      continue;
    }
    while (any && at < printed.size() && !is_shown(line, printed[at])) ++at;
    if (at == printed.size() || !is_shown(line, printed[at])) return line;
    ++at;
    any = false;
  }
  return any || at == printed.size() ? "" : "(the end, not " + printed[at] + ")";
}

}  // namespace dpde::testing
