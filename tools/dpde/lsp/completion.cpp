// SPDX-License-Identifier: Apache-2.0
#include "lsp/completion.h"

#include <algorithm>
#include <initializer_list>

#include "lsp/cursor_place.h"
#include "lsp/word_texts.h"
#include "model/print/words.h"
#include "support/names/bound_names.h"
#include "support/side_conditions.h"
#include "syntax/words.h"

namespace dpde::lsp {

namespace {

/// CompletionItemKind of the protocol.
enum class ItemKind { function = 3, variable = 6, module = 9, property = 10, keyword = 14, choice = 20 };

class Candidates {
 public:
  Candidates(const Document& document, int offset)
      : document_(document), offset_(offset), place_(cursor_place(document.source(), offset)) {}

  Json find() {
    switch (place_.where) {
      case CursorPlace::Where::outside: break;
      case CursorPlace::Where::top: add_words(ast::words_of_declarations(), text_of_block); break;
      case CursorPlace::Where::head: add_for_head(); break;
      case CursorPlace::Where::line: place_.begins_line() ? add_for_begin() : add_for_line(); break;
    }
    return std::move(items_);
  }

 private:
  std::string_view block() const { return place_.blocks.front(); }
  bool is_behind_comma() const { return place_.is_behind(ast::TokenKind::comma); }
  bool is_behind_assign() const { return place_.is_behind(ast::TokenKind::assign); }

  void add(const std::string& label, ItemKind kind, std::string_view detail, std::string_view text = "") {
    const bool is_new = std::ranges::none_of(items_, [&](const Json& item) { return item.at("label") == Json(label); });
    if (label.empty() || !is_new) return;
    Json item = {{"label", label}, {"kind", static_cast<int>(kind)}};
    if (!detail.empty()) item["detail"] = detail;
    if (!text.empty()) item["documentation"] = text;
    items_.push_back(std::move(item));
  }

  template <class TextOf>
  void add_words(const std::vector<std::string>& words, const TextOf& text_of, ItemKind kind = ItemKind::keyword) {
    for (const std::string& word : words) {
      const WordText* text = text_of(word);
      add(word, kind, text == nullptr ? "" : text->usage, text == nullptr ? "" : text->text);
    }
  }
  void add_plain(const std::vector<std::string>& words, ItemKind kind) {
    for (const std::string& word : words) add(word, kind, "");
  }

  void add_blocks(std::initializer_list<std::string_view> kinds) {
    for (const DeclaredName& name : document_.names()) {
      if (name.block < 0 && std::ranges::find(kinds, name.word) != kinds.end())
        add(name.name, ItemKind::module, name.word);
    }
  }
  void add_names(std::initializer_list<std::string_view> kinds) {
    for (const DeclaredName* name : document_.names_at(offset_)) {
      if (name->block >= 0 && std::ranges::find(kinds, name->word) != kinds.end())
        add(name->name, ItemKind::variable, name->word);
    }
  }

  void add_for_head() {
    const std::string_view word = place_.word();
    if (place_.is_behind("with")) return add_blocks({"scheme"});
    if (word == "scene" && is_behind_assign()) return add_blocks({"scene"});
    if (place_.is_behind(ast::TokenKind::colon) || is_behind_comma()) {
      if (word == "scene") return add_blocks({"model", "program"});
      return add_blocks({"scene"});
    }
    if (place_.before.size() > 2) add("with", ItemKind::keyword, "with SCHEME");
    if (word == "function" || word == "operator") add_formula();
  }

  void add_for_begin() {
    add_words(ast::words_of_block(block()), [&](std::string_view word) { return text_of_line(block(), word); });
    if (block() == "scheme") add_words(model::words_of_schemes(), text_of_key, ItemKind::property);
    if (block() == "scene") add_names({"param", "coefficient", "mask", "control", "control field"});
    if (block() == "network") add_plain(model::words_of_layers(), ItemKind::function);
    if (block() == "kernel") add_names({"parameter"});
    if (block() == "loop") add_blocks({"program"});
  }

  void add_for_line() {
    const std::string_view word = place_.word();
    if (block() == "scheme") return add_for_row();
    if (place_.is_behind("scene")) return add_blocks({"scene"});
    if (place_.is_behind("on") && word != "test") return add_plain(model::words_of_placements(), ItemKind::choice);
    if (word == "learn" || word == "apply") add_blocks({"network"});
    if (block() == "program" && word == "run") return add_blocks({"kernel"});
    if (word == "gradient" && block() == "chart") return add_blocks({"task"});
    if (is_behind_comma() && block() == "scene") add_options(word);
    if (word == "boundary" || word == "fill") add_sides();
    if (word == "using") add_optimisers();
    if (word == "vary" && block() == "chart") add_plain(model::words_of_schemes(), ItemKind::property);
    add_formula();
  }

  void add_for_row() {
    if (is_behind_assign())
      add_plain(model::choices_of(std::string(place_.word())), ItemKind::choice);
    else if (place_.before.size() == 1)
      add_names({"field", "vector"});
  }

  void add_options(std::string_view word) {
    if (word == "grid") add_plain({std::begin(ast::grid_options), std::end(ast::grid_options)}, ItemKind::property);
    if (word == "time") add_plain({std::begin(ast::time_options), std::end(ast::time_options)}, ItemKind::property);
  }

  void add_sides() {
    for (const SideCondition& condition : side_condition_table()) {
      const bool is_here = block() == "scene" ? condition.level != SideCondition::Level::programs
                                              : condition.level != SideCondition::Level::models;
      if (is_here) add(std::string(condition.word), ItemKind::choice, condition.usage);
    }
    add("periodic", ItemKind::choice, "");
  }

  void add_optimisers() {
    if (place_.before.size() == 1) add_plain(model::words_of_optimisers(), ItemKind::function);
    if (is_behind_comma()) {
      add("iterations", ItemKind::property, "iterations 50");
      add_plain(model::words_of_training(), ItemKind::property);
    }
  }

  void add_formula() {
    for (const DeclaredName* name : document_.names_at(offset_)) {
      const bool is_called = name->word == "function" || name->word == "operator" || name->word == "network";
      if (name->block >= 0 && name->word != "axis") add(name->name, ItemKind::variable, name->word);
      if (name->block < 0 && is_called) add(name->name, ItemKind::function, name->word);
    }
    add_words(model::words_of_functions(), text_of_function, ItemKind::function);
    for (const BoundName& bound : bound_names) add(std::string(bound.name), ItemKind::variable, bound.meaning);
    add("pi", ItemKind::variable, "a constant");
  }

  const Document& document_;
  int offset_;
  CursorPlace place_;
  Json items_ = Json::array();
};

}  // namespace

Json completions(const Document& document, int offset) { return Candidates(document, offset).find(); }

}  // namespace dpde::lsp
