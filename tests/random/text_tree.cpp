// SPDX-License-Identifier: Apache-2.0
#include "random/text_tree.h"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <set>

namespace dpde::testing {

namespace {

using TryPart = std::function<bool(const Part&)>;

/// All parts, outer ones first.
void collect(Part& part, std::vector<Part*>& found) {
  found.push_back(&part);
  for (Part& inner : part.parts) collect(inner, found);
}

std::vector<Part*> all_of(Part& whole) {
  std::vector<Part*> found;
  collect(whole, found);
  return found;
}

std::set<std::string> words_of(const std::string& text) {
  std::set<std::string> words;
  for (std::size_t i = 0; i < text.size();) {
    const auto is_word = [&](std::size_t k) {
      return k < text.size() && (std::isalnum(static_cast<unsigned char>(text[k])) || text[k] == '_');
    };
    std::size_t end = i;
    while (is_word(end)) ++end;
    if (end > i) words.insert(text.substr(i, end - i));
    i = std::max(end, i + 1);
  }
  return words;
}

bool may_go(const Part& holder, const Part& part) {
  return part.kind == Part::Kind::item || (holder.kind == Part::Kind::list && holder.parts.size() > 1);
}

/// `part` is a fixed hole of its holder: what is left of the text has to have none.
void erase(Part& holder, std::size_t index) {
  holder.parts.erase(holder.parts.begin() + static_cast<std::ptrdiff_t>(index));
  if (holder.kind == Part::Kind::list || holder.kind == Part::Kind::tuple) return;
  std::size_t hole = 0;
  for (std::size_t i = 0; i <= index; ++i) hole = holder.text.find('@', i == 0 ? 0 : hole + 1);
  holder.text.erase(hole, 1);
}

bool drop_one(const Part& whole, const TryPart& accept) {
  Part copy = whole;
  const std::size_t count = all_of(copy).size();
  for (std::size_t h = 0; h < count; ++h) {
    for (std::size_t i = all_of(copy)[h]->parts.size(); i-- > 0;) {
      Part candidate = whole;
      Part& holder = *all_of(candidate)[h];
      if (!may_go(holder, holder.parts[i])) continue;
      erase(holder, i);
      if (accept(candidate)) return true;
    }
  }
  return false;
}

/// Everything that may go and for which `is_out` holds.
void drop_where(Part& holder, const std::function<bool(const std::string&)>& is_out) {
  for (std::size_t i = holder.parts.size(); i-- > 0;) {
    const bool goes = may_go(holder, holder.parts[i]) && is_out(print(holder.parts[i]));
    const bool has_inner =
        std::ranges::any_of(holder.parts[i].parts, [](const Part& p) { return p.kind == Part::Kind::item; });
    if (goes && !has_inner) {
      erase(holder, i);
    } else {
      drop_where(holder.parts[i], is_out);
    }
  }
}

bool drop_names(const Part& whole, const TryPart& accept) {
  for (const std::string& word : words_of(print(whole))) {
    if (std::isdigit(static_cast<unsigned char>(word[0]))) continue;
    Part candidate = whole;
    drop_where(candidate, [&](const std::string& text) { return words_of(text).contains(word); });
    if (accept(candidate)) return true;
  }
  return false;
}

bool drop_axis(const Part& whole, const TryPart& accept) {
  for (const char* axis : {"z", "y"}) {
    const std::string grid = std::string("grid ") + axis, side = std::string(axis);
    if (print(whole).find(grid) == std::string::npos) continue;
    Part candidate = whole;
    drop_where(candidate, [&](const std::string& text) {
      return text.starts_with(grid) || text.starts_with(side + ".") || text.starts_with(side + " =");
    });
    for (Part* part : all_of(candidate)) {
      if (part->kind == Part::Kind::tuple) part->parts.pop_back();
    }
    return accept(candidate);
  }
  return false;
}

void collect_smaller(const Part& part, std::vector<Part>& found) {
  for (const Part& inner : part.parts) {
    if (inner.kind == Part::Kind::expression) found.push_back(inner);
    collect_smaller(inner, found);
  }
}

bool simplify_expressions(const Part& whole, const TryPart& accept) {
  Part copy = whole;
  const std::vector<Part*> parts = all_of(copy);
  for (std::size_t p = 0; p < parts.size(); ++p) {
    if (parts[p]->kind != Part::Kind::expression) continue;
    std::vector<Part> smaller;
    const std::string now = print(*parts[p]);
    for (const char* number : {"0", "1", "2"}) {
      if (now == number) break;
      smaller.push_back(expression(number));
    }
    collect_smaller(*parts[p], smaller);
    for (const Part& other : smaller) {
      Part candidate = whole;
      *all_of(candidate)[p] = other;
      if (accept(candidate)) return true;
    }
  }
  return false;
}

}  // namespace

std::string print(const Part& part) {
  std::string text;
  if (part.kind == Part::Kind::list || part.kind == Part::Kind::tuple) {
    for (const Part& inner : part.parts) text += (text.empty() ? "" : ", ") + print(inner);
    return part.kind == Part::Kind::tuple && part.parts.size() > 1 ? "(" + text + ")" : text;
  }
  std::size_t next = 0;
  for (const char c : part.text) {
    if (c == '@') {
      text += print(part.parts.at(next++));
    } else {
      text += c;
    }
  }
  return text;
}

Part shrink(Part whole, const std::function<bool(const std::string&)>& fails, int most, double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  std::set<std::string> seen{print(whole)};
  const TryPart accept = [&](const Part& candidate) {
    if (std::chrono::steady_clock::now() > end) most = 0;
    if (most <= 0 || !seen.insert(print(candidate)).second) return false;
    --most;
    if (!fails(print(candidate))) return false;
    whole = candidate;
    return true;
  };
  const auto round = [&] {
    const Part now = whole;
    return drop_one(now, accept) || drop_names(now, accept) || drop_axis(now, accept) ||
           simplify_expressions(now, accept);
  };
  while (most > 0 && round()) {
  }
  return whole;
}

}  // namespace dpde::testing
