// SPDX-License-Identifier: Apache-2.0
#include "fuzz/mutate.h"

#include <cctype>

namespace dpde::testing {

namespace {

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }

/// Words, runs of blanks, and single characters.
std::vector<std::string> tokens_of(const std::string& text) {
  std::vector<std::string> tokens;
  for (std::size_t i = 0; i < text.size();) {
    std::size_t end = i + 1;
    const auto same = [&](char c) { return is_word(text[i]) ? is_word(c) : text[i] == ' ' && c == ' '; };
    while (end < text.size() && same(text[end])) ++end;
    tokens.push_back(text.substr(i, end - i));
    i = end;
  }
  return tokens;
}

std::string joined(const std::vector<std::string>& tokens) {
  std::string text;
  for (const std::string& token : tokens) text += token;
  return text;
}

template <class T>
const T& any(const std::vector<T>& list, SplitMix& random) {
  return list[random.below(static_cast<int>(list.size()))];
}

const std::vector<std::string> pieces = {"0",
                                         "-1",
                                         "1",
                                         "2.5",
                                         "1e308",
                                         "1e-320",
                                         "99999999999",
                                         "2147483647",
                                         "(",
                                         ")",
                                         "{",
                                         "}",
                                         "[",
                                         "]",
                                         "[+1]",
                                         "[0, -9]",
                                         ",",
                                         ";",
                                         "=",
                                         "+=",
                                         "..",
                                         "^",
                                         "/0",
                                         "-",
                                         "not ",
                                         " in m/s",
                                         " in kg^2",
                                         " and ",
                                         "\n",
                                         "\"",
                                         "#",
                                         "u",
                                         "x",
                                         "t",
                                         "pi",
                                         "dt",
                                         "inside[+1]",
                                         "interp(u, 0.5)",
                                         "if(x < 0, u, 1)",
                                         "periodic",
                                         "zero_gradient",
                                         "linear",
                                         "gradient(1)",
                                         "mixed(1, 0, 2)",
                                         "fill u periodic",
                                         "grow 3",
                                         "lap(u)",
                                         "grad(u)",
                                         "div(u)",
                                         "u.x",
                                         "dt(dt(u))",
                                         "load(\"f.nc\")",
                                         "at t = 1",
                                         "over time",
                                         "vector ",
                                         "coefficient ",
                                         "residual { relu }",
                                         "conv 4, 3",
                                         "conv out, 1",
                                         "upsample 2",
                                         "-> vector",
                                         ".x",
                                         "over 4 steps",
                                         "_",
                                         "\xff",
                                         "\xce\xbd",
                                         std::string(1, '\0')};

const std::vector<std::string> numbers = {"0", "1", "2", "3", "0.5", "1e-9", "7", "100000"};

/// A name for a name, a number for a number: most of what comes out can be parsed.
void exchange_word(std::vector<std::string>& tokens, const std::vector<std::string>& others, SplitMix& random) {
  for (int tries = 0; tries < 20; ++tries) {
    std::string& token = tokens[random.below(static_cast<int>(tokens.size()))];
    const std::string& other = any(others, random);
    const auto is_number = [](const std::string& t) { return std::isdigit(static_cast<unsigned char>(t[0])) != 0; };
    if (!is_word(token[0]) || !is_word(other[0])) continue;
    token = is_number(token) ? any(numbers, random) : is_number(other) ? token : other;
    return;
  }
}

void change_token(std::vector<std::string>& tokens, const std::vector<std::string>& others, SplitMix& random) {
  if (tokens.empty()) return;
  if (random.percent(65)) return exchange_word(tokens, others, random);
  const auto at = tokens.begin() + random.below(static_cast<int>(tokens.size()));
  switch (random.below(6)) {
    case 0: tokens.erase(at); break;
    case 1: tokens.insert(at, any(pieces, random)); break;
    case 2: *at = any(pieces, random); break;
    case 3: *at = any(others, random); break;
    case 4: std::swap(*at, tokens[random.below(static_cast<int>(tokens.size()))]); break;
    default: {
      const std::size_t from = random.below(static_cast<int>(others.size()));
      const std::size_t count = std::min<std::size_t>(1 + random.below(30), others.size() - from);
      tokens.insert(at, others.begin() + static_cast<std::ptrdiff_t>(from),
                    others.begin() + static_cast<std::ptrdiff_t>(from + count));
    }
  }
}

void change_byte(std::string& text, SplitMix& random) {
  if (text.empty()) return;
  const std::size_t at = random.below(static_cast<int>(text.size()));
  switch (random.below(4)) {
    case 0: text[at] = static_cast<char>(random.below(256)); break;
    case 1: text.erase(at, 1 + random.below(20)); break;
    case 2: text.insert(at, 1, static_cast<char>(random.below(256))); break;
    default: text.resize(at);
  }
}

}  // namespace

std::string Mutator::operator()(SplitMix& random) const {
  std::vector<std::string> tokens = tokens_of(any(corpus_, random));
  const std::vector<std::string> others = random.percent(80) ? tokens : tokens_of(any(corpus_, random));
  for (int edits = 1 + random.below(3); edits > 0; --edits) change_token(tokens, others, random);
  std::string text = joined(tokens);
  if (random.percent(15)) change_byte(text, random);
  return text;
}

}  // namespace dpde::testing
