// SPDX-License-Identifier: Apache-2.0
#include "random/swapped_axes.h"

#include <cctype>
#include <map>
#include <vector>

namespace dpde::testing {

namespace {

bool is_of_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

/// Words of axes, also behind a dot: u.x, x.low. `dx = central(4)` in a scheme is of all axes.
std::string with_words_swapped(const std::string& text) {
  static const std::map<std::string, std::string> others = {{"x", "y"},   {"y", "x"},   {"dx", "dy"},
                                                            {"dy", "dx"}, {"hx", "hy"}, {"hy", "hx"}};
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    std::size_t end = i;
    while (end < text.size() && is_of_word(text[end])) ++end;
    const std::string word = text.substr(i, end - i);
    const auto other = others.find(word);
    const bool is_kept = other == others.end() || (word == "dx" && text.compare(end, 3, " = ") == 0);
    result += word.empty() ? std::string(1, text[i]) : is_kept ? word : other->second;
    i = std::max(end, i + 1);
  }
  return result;
}

/// Offsets [i, j, k] and tuples (a, b, c): the first two entries. What stands behind a name in parentheses is a call.
std::string with_entries_swapped(const std::string& text) {
  struct Open {
    std::size_t at = 0;
    bool is_call = false;
    std::vector<std::size_t> commas = {};
  };
  std::string result;
  std::vector<Open> open;
  for (const char c : text) {
    if (c == '(' || c == '[') open.push_back({result.size(), c == '(' && !result.empty() && is_of_word(result.back())});
    if (c == ',' && !open.empty()) open.back().commas.push_back(result.size());
    if ((c == ')' || c == ']') && !open.empty()) {
      const auto [at, is_call, commas] = open.back();
      open.pop_back();
      if (!is_call && !commas.empty()) {
        const std::size_t end = commas.size() > 1 ? commas[1] : result.size();
        const std::string first = result.substr(at + 1, commas[0] - at - 1),
                          second = result.substr(commas[0] + 1, end - commas[0] - 1);
        result.replace(at + 1, end - at - 1, second + "," + first);
      }
    }
    result += c;
  }
  return result;
}

/// The grid of x stands first again.
std::string with_grids_in_order(const std::string& text) {
  const std::size_t y = text.find("  grid y"), x = text.find("  grid x");
  const std::size_t end = text.find('\n', x) + 1;
  return text.substr(0, y) + text.substr(x, end - x) + text.substr(y, x - y) + text.substr(end);
}

bool has(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

}  // namespace

std::optional<std::string> with_swapped_axes(const std::string& text) {
  if (!has(text, "  grid y") || has(text, "noise(")) return std::nullopt;
  return with_grids_in_order(with_entries_swapped(with_words_swapped(text)));
}

}  // namespace dpde::testing
