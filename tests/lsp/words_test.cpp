// SPDX-License-Identifier: Apache-2.0
// Hover and completion, and that texts and the grammars of editors have the words that the parser goes by.
#include "model/print/words.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "lsp/client.h"
#include "lsp/word_texts.h"
#include "support/names/units.h"
#include "support/side_conditions.h"
#include "syntax/words.h"

namespace dpde::lsp {
namespace {

using Words = std::set<std::string>;

Words as_set(const std::vector<std::string>& words) { return {words.begin(), words.end()}; }

bool has_all(const Words& words, const Words& wanted) { return std::ranges::includes(words, wanted); }

TEST(LanguageServer, HoverTellsWhatNamesAre) {
  const std::string text = rod_text;
  Client client;
  client.open(text);
  const auto holds = [&](const std::string& mark, std::size_t behind, const std::vector<std::string>& parts) {
    const std::string hover = client.hover(text, mark, behind);
    for (const std::string& part : parts) EXPECT_NE(hover.find(part), std::string::npos) << part << " in\n" << hover;
  };
  holds("lap(u)", 4, {"field u", "field of model heat", "`rod`: at cell centres, 16 cells; steps: 512"});
  holds("k*lap", 0, {"param k = 0.3", "param of model heat", "`rod`: k = 0.3", "`find`: k = 0.3, sought"});
  holds("rod : heat", 1, {"scene rod : heat with ftcs", "16 cells, 512 steps of 0.00195312"});
  holds("lap(u)", 1, {"lap(f)", "second derivatives", "`rod`: lap = central(2), of order 2"});
  holds("lap = central", 1, {"one of: central(2), central(4), central(6), central(8), spectral"});
  holds("minimise", 2, {"the loss"});
  holds("task find", 1, {"what is asked"});
  EXPECT_EQ(client.hover(text, "= central", 0), "");
  // What was known stays while a line is written.
  const std::string typed = replaced(text, "dt(u) = k*lap(u)", "dt(u) = k*lap(u");
  client.change(typed);
  EXPECT_NE(client.hover(typed, "k*lap", 0).find("`rod`: k = 0.3"), std::string::npos);
}

TEST(LanguageServer, HoverTellsUnits) {
  const std::string text =
      "model m {\n  field u in K\n  param k = 1 in m^2/s\n  let flux = -k*dx(u)\n  dt(u) = -dx(flux)\n}\n"
      "scene s : m {\n  grid x = 0 .. 1 in m, cells 8, periodic\n  initial u = 0\n  observe heat = integral(u)\n"
      "  time 0 .. 1 in s, step 1/8\n}\n";
  Client client;
  client.open(text);
  EXPECT_NE(client.hover(text, "field u", 6).find("; in K"), std::string::npos) << client.hover(text, "field u", 6);
  EXPECT_NE(client.hover(text, "k*dx", 0).find("`s`: k = 1; in m^2/s"), std::string::npos);
  EXPECT_NE(client.hover(text, "dx(flux)", 3).find("`s`: in K*m/s"), std::string::npos);
  EXPECT_NE(client.hover(text, "heat =", 0).find("`s`: in K*m"), std::string::npos);
}

TEST(LanguageServer, CompletesWhatMayStandThere) {
  Client client;
  const std::string head =
      "model heat {\n  field u\n  param k\n  let flow = k*u\n  dt(u) = k*lap(u)\n}\n"
      "scheme a { time = rk4 }\n";
  const auto behind = [&](const std::string& typed) {
    client.open(head + typed + "\n");
    return client.completions(head + typed + "\n", typed);
  };
  EXPECT_EQ(behind("sc"), as_set(ast::words_of_declarations()));
  EXPECT_EQ(behind("scene rod : h"), (Words{"heat"}));
  EXPECT_EQ(behind("scene rod : heat with "), (Words{"a"}));
  EXPECT_TRUE(has_all(behind("scene rod : heat {\n  "), {"grid", "initial", "time", "k"}));
  EXPECT_TRUE(has_all(behind("scene rod : heat {\n  grid x = 0 .. 1, "), {"cells", "periodic", "stretched"}));
  EXPECT_TRUE(has_all(behind("scene rod : heat {\n  time 0 .. 1, st"), {"step", "courant", "until steady"}));
  EXPECT_TRUE(has_all(behind("scene rod : heat {\n  observe m = mean("), {"u", "k", "flow", "sin", "x", "pi"}));
  EXPECT_TRUE(has_all(behind("scene rod : heat {\n  boundary u: x.low = "), {"zero_gradient", "outflow"}));
  EXPECT_TRUE(behind("scene rod : heat {}\nscene fine = ").contains("rod"));
  EXPECT_EQ(behind("model m {\n  field u on "), as_set(model::words_of_placements()));
  EXPECT_TRUE(has_all(behind("scene rod : heat {}\ntask t : rod {\n  data v = u from scene "), {"rod"}));
  EXPECT_TRUE(has_all(behind("scene rod : heat {}\ntask t : rod {\n  minimise mean("), {"u", "k"}));
  EXPECT_TRUE(has_all(behind("scene rod : heat {}\ntask t : rod {\n  using "), {"lbfgs", "adam"}));
  EXPECT_EQ(behind("scheme b { la"), as_set(model::words_of_schemes()));
  EXPECT_EQ(behind("scheme b { time = "), as_set(model::choices_of("time")));
  EXPECT_EQ(behind("scheme b { time = rk4; lap = cen"), as_set(model::choices_of("lap")));
  EXPECT_EQ(behind("# sc"), Words());
  EXPECT_EQ(behind("import \"fl"), Words());
  // A block that is not closed ends where the next begins.
  EXPECT_EQ(behind("scene rod : heat {\n  grid x = 0 .. 1\nscheme b {\n  real = "), (Words{"f32", "f64"}));
}

/// Each word that the parser goes by has its text, and no other.
TEST(LanguageServer, EveryWordHasItsText) {
  for (const std::string& word : model::words_of_functions()) EXPECT_NE(text_of_function(word), nullptr) << word;
  for (const std::string& word : ast::words_of_declarations()) EXPECT_NE(text_of_block(word), nullptr) << word;
  for (const std::string& key : model::words_of_schemes()) {
    EXPECT_NE(text_of_key(key), nullptr) << key;
    EXPECT_GE(model::choices_of(key).size(), 2u) << key;
  }
  for (const std::string& block : ast::kinds_of_block()) {
    for (const std::string& word : ast::words_of_block(block))
      EXPECT_NE(text_of_line(block, word), nullptr) << block << ": " << word;
  }
}

std::string content(const std::string& path) {
  std::ifstream in(std::string(DPDE_SOURCE_DIR) + "/" + path);
  std::stringstream text;
  text << in.rdbuf();
  EXPECT_FALSE(text.str().empty()) << path;
  return text.str();
}

/// The words of (a|b|c) behind `begin`.
Words words_behind(const std::string& text, const std::string& begin) {
  const std::size_t at = text.find(begin), open = at + begin.size();
  Words words;
  if (at == std::string::npos) return words;
  std::stringstream list(text.substr(open, text.find(')', open) - open));
  for (std::string word; std::getline(list, word, '|');) words.insert(word);
  return words;
}

Words words_of_lines() {
  Words words;
  for (const std::string& block : ast::kinds_of_block()) words.merge(as_set(ast::words_of_block(block)));
  words.erase("dt");  // a function there
  return words;
}

/// What the parser asks for inside of lines, as its text has it; words that often mean something else are left out.
Words words_in_lines() {
  const Words left_out{"t", "solve", "dt", "high", "low", "mean", "sum", "integral", "or", "not", "axis"};
  const std::regex asked(R"re((?:at|accept|expect)_word\("([a-z_0-9]+)"\))re");
  Words words;
  for (const char* part : {"chart", "declaration", "expression", "kernel", "network", "physics", "task"}) {
    const std::string text = content(std::string("compiler/src/syntax/parse/parse_") + part + ".cpp");
    for (auto found = std::sregex_iterator(text.begin(), text.end(), asked); found != std::sregex_iterator(); ++found)
      if (!left_out.contains((*found)[1])) words.insert((*found)[1]);
  }
  return words;
}

std::string text_of_manual() {
  std::string text;
  for (const auto& entry : std::filesystem::directory_iterator(std::string(DPDE_SOURCE_DIR) + "/dsl-examples/manual"))
    text += content("dsl-examples/manual/" + entry.path().filename().string());
  return text;
}

/// Whether the word stands there, and not as a part of a longer one.
bool holds_word(const std::string& text, const std::string& word) {
  const auto is_inside = [&](std::size_t at) {
    return at < text.size() && (std::isalnum(static_cast<unsigned char>(text[at])) || text[at] == '_');
  };
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
    if ((at == 0 || !is_inside(at - 1)) && !is_inside(at + word.size())) return true;
  }
  return false;
}

Words words_of_sides() {
  Words words;
  for (const SideCondition& condition : side_condition_table()) {
    if (condition.level != SideCondition::Level::programs && !condition.word.empty()) words.emplace(condition.word);
  }
  return words;
}

TEST(LanguageServer, EveryWordIsInTheManual) {
  const std::string manual = text_of_manual();
  Words words = as_set(model::words_of_functions());
  words.merge(words_of_sides());
  for (const std::string& key : model::words_of_schemes()) {
    words.insert(key);
    for (const std::string& choice : model::choices_of(key))  // lie(advect, sources, diffusion): in any order
      words.insert(choice.substr(0, choice.find(',') == std::string::npos ? choice.size() : choice.find('(')));
  }
  for (const std::string& word : words) EXPECT_TRUE(holds_word(manual, word)) << word;
}

TEST(Editors, GrammarsHaveTheWordsOfTheParser) {
  Words functions = as_set(model::words_of_functions());
  functions.insert("dt");
  const std::optional<Json> grammar = parse_json(content("tools/editors/vscode/syntaxes/dpde.tmLanguage.json"));
  ASSERT_TRUE(grammar.has_value());
  const auto of_grammar = [&](const char* rule) {
    return words_behind(grammar->at("repository").at(rule).at("match").get<std::string>(), "\\b(");
  };
  EXPECT_EQ(of_grammar("declaration"), as_set(ast::words_of_declarations()));
  EXPECT_EQ(of_grammar("line"), words_of_lines());
  EXPECT_EQ(of_grammar("key"), as_set(model::words_of_schemes()));
  EXPECT_EQ(of_grammar("function"), functions);
  EXPECT_EQ(of_grammar("option"), words_in_lines());
  EXPECT_EQ(of_grammar("side"), words_of_sides());
  const std::regex unit(grammar->at("repository").at("unit").at("match").get<std::string>());
  for (const std::string& symbol : unit_symbols()) {
    for (const std::string& written : {"in " + symbol, "in " + symbol + "^2/s", "in 1/" + symbol})
      EXPECT_TRUE(std::regex_match(written, unit)) << written;
  }
  for (const char* other : {"in 0 .. 1", "in central(2), upwind(3)", "in cheap, precise", "in 4"})
    EXPECT_FALSE(std::regex_search(other, unit)) << other;
  const std::string vim = content("tools/editors/vim/syntax/dpde.vim");
  EXPECT_EQ(words_behind(vim, "dpdeDeclaration /\\v(^|[};])@1<=\\s*<("), as_set(ast::words_of_declarations()));
  EXPECT_EQ(words_behind(vim, "dpdeLine /\\v(^|[{};])@1<=\\s*<("), words_of_lines());
  EXPECT_EQ(words_behind(vim, "dpdeKey /\\v<("), as_set(model::words_of_schemes()));
  EXPECT_EQ(words_behind(vim, "dpdeFunction /\\v<("), functions);
  Words options, sides;
  std::stringstream lines(vim);
  for (std::string line; std::getline(lines, line);) {
    const std::vector<std::pair<std::string, Words*>> lists{{"syntax keyword dpdeOption ", &options},
                                                            {"syntax keyword dpdeSide ", &sides}};
    for (const auto& [begin, words] : lists) {
      if (!line.starts_with(begin)) continue;
      std::stringstream list(line.substr(begin.size()));
      for (std::string word; list >> word;) words->insert(word);
    }
  }
  EXPECT_EQ(options, words_in_lines());
  EXPECT_EQ(sides, words_of_sides());
}

}  // namespace
}  // namespace dpde::lsp
