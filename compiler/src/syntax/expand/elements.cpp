// SPDX-License-Identifier: Apache-2.0
#include "syntax/expand/elements.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>

namespace dpde::ast {

Element element_of(const std::string& name) {
  Element element;
  const std::size_t begin = name.rfind('(') + 1, open = name.find('['), close = name.find(']');
  const std::size_t end = open != std::string::npos ? open : std::min(name.size(), name.find(')'));
  element.before = name.substr(0, begin);
  element.array = name.substr(begin, end - begin);
  element.behind = name.substr(open != std::string::npos ? close + 1 : end);
  for (std::size_t at = open; open != std::string::npos && at < close;) {
    const std::size_t comma = std::min(name.find(", ", at + 1), close);
    element.indices.push_back(name.substr(at + 1, comma - at - 1));
    at = comma == close ? close : comma + 1;
  }
  return element;
}

std::optional<int> number_in(const std::string& index) {
  int value = 0;
  const auto result = std::from_chars(index.data(), index.data() + index.size(), value);
  return result.ec == std::errc() ? std::optional(value) : std::nullopt;
}

std::string text_of(const std::string& array, const std::vector<int>& extents) {
  return fmt::format("{}[{}]", array, fmt::join(extents, ", "));
}

void for_each_value(const std::vector<int>& extents, const std::function<void(const std::vector<int>&)>& f) {
  std::vector<int> at(extents.size(), 1);
  while (true) {
    f(at);
    std::size_t k = extents.size();
    while (k > 0 && at[k - 1] == extents[k - 1]) at[--k] = 1;
    if (k == 0) return;
    ++at[k - 1];
  }
}

}  // namespace dpde::ast
