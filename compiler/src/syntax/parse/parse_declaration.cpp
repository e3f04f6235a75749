// SPDX-License-Identifier: Apache-2.0
// Parses files and blocks, and checks the order of their parts.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "syntax/parse/parse_parts.h"
#include "syntax/parser.h"
#include "syntax/words.h"

namespace dpde::ast {
namespace {

// ---- blocks --------------------------------------------------------------------------------------------------------
std::vector<std::string> words_of(const BlockRule& rule) {
  std::vector<std::string> words;
  for (const ItemRule& item : rule.items) words.emplace_back(item.word);
  return words;
}

std::string understood(const BlockRule& rule) {
  std::vector<std::string> words = words_of(rule);
  if (!rule.named.example.empty()) words.emplace_back(rule.named.example);
  return fmt::format("understood here: {}", fmt::join(words, ", "));
}

/// Translates a word of other tools to dpde; "" if it is unknown.
std::string_view said_elsewhere(std::string_view word) {
  constexpr std::pair<std::string_view, std::string_view> words[] = {
      {"maximise", "a task seeks what is least: minimise -mean(u)"},
      {"maximize", "a task seeks what is least: minimise -mean(u)"},
      {"minimize", "write minimise"},
      {"objective", "write minimise"},
      {"loss", "write minimise"},
      {"const", "write param nu = 0.01 in a model, let k = 2 in a scene"},
      {"var", "write field u"},
      {"variable", "write field u"},
      {"domain", "write grid x = 0 .. 1, cells 128"},
      {"mesh", "write grid x = 0 .. 1, cells 128"},
      {"bc", "write boundary u: x.low = 0, x.high = 1"},
      {"ic", "write initial u = 0"}};
  const auto* found = std::ranges::find(words, word, &std::pair<std::string_view, std::string_view>::first);
  return found == std::end(words) ? "" : found->second;
}

/// "did you mean ..." for a typo, "it belongs in ..." for the wrong block; always lists the valid words.
std::string hint_for(std::string_view word, const BlockRule& here) {
  const std::string_view elsewhere = said_elsewhere(word);
  if (!elsewhere.empty()) return fmt::format("{}; {}", elsewhere, understood(here));
  const std::string near = nearest_name(word, words_of(here));
  if (!near.empty()) return fmt::format("did you mean {}? {}", near, understood(here));
  for (const BlockRule& rule : {model_rule(), scene_rule(), task_rule(), kernel_rule(), program_rule(), repeat_rule(),
                                network_rule(), data_set_rule(), chart_rule()}) {
    for (const ItemRule& item : rule.items) {
      if (item.word == word) return fmt::format("{} belongs in a {}; {}", word, rule.name, understood(here));
    }
  }
  return understood(here);
}

ItemKind parse_item(Cursor& cursor, const BlockRule& rule) {
  if (rule.named.begins != nullptr && rule.named.begins(cursor)) return rule.named.parse(cursor);
  for (const ItemRule& item : rule.items) {
    if (cursor.accept_word(item.word)) return item.parse(cursor);
  }
  const Token token = cursor.peek();
  if (token.kind == TokenKind::identifier) {
    cursor.fail("unknown-item", token.range, {quoted(token.spelling), std::string(rule.name)},
                hint_for(token.spelling.substr(0, 40), rule));
  } else {
    cursor.fail_expected(fmt::format("an item of the {}", rule.name), understood(rule));
  }
  return {};
}

void add_item(Cursor& cursor, const BlockRule& rule, std::vector<Item>& items) {
  const int start = cursor.position();
  Item item;
  item.trivia = cursor.take_comments_above();
  if (items.empty()) item.trivia.blank_before = false;
  item.kind = parse_item(cursor, rule);
  cursor.expect_end_of_item();
  if (cursor.failed()) {
    cursor.recover(start);
    return;
  }
  item.range = cursor.range_since(start);
  cursor.collect_inner_comments(item.trivia);
  item.trivia.after = cursor.take_comment_behind();
  items.push_back(std::move(item));
}

/// Comments at the end of a block or file: no blank line at the end; one before if the source has one.
std::vector<std::string> closing_comments(Trivia trivia, bool nothing_before) {
  std::vector<std::string> comments = std::move(trivia.before);
  if (!comments.empty() && comments.back().empty()) comments.pop_back();
  if (!comments.empty() && trivia.blank_before && !nothing_before) comments.insert(comments.begin(), "");
  return comments;
}

void close_block(Cursor& cursor, BlockLayout& layout, bool is_empty) {
  layout.closing_comments = closing_comments(cursor.take_comments_above(), is_empty);
  cursor.take();
}

/// Parses { ... }; calls `parse_one` at the beginning of every item.
template <class ParseOne>
void parse_block(Cursor& cursor, BlockLayout& layout, std::string_view name, const ParseOne& parse_one) {
  if (cursor.at(TokenKind::line_break) && cursor.peek_second().kind == TokenKind::left_brace) cursor.take();
  const int open = cursor.position();
  const SourceRange brace = cursor.peek().range;
  if (!cursor.expect(TokenKind::left_brace)) return;
  Trivia header;
  cursor.collect_inner_comments(header);
  layout.before = std::move(header.before);
  layout.after = cursor.take_comment_behind();
  for (bool is_first = true;; is_first = false) {
    cursor.skip_separators();
    if (cursor.at(TokenKind::right_brace)) {
      close_block(cursor, layout, is_first);
      layout.one_line = !cursor.has_line_break_since(open);
      return;
    }
    if (cursor.at(TokenKind::end_of_file) || cursor.at_declaration()) {
      cursor.error("unclosed-block", brace, {std::string(name)});
      return;
    }
    parse_one();
  }
}

void parse_items(Cursor& cursor, Declaration& declaration, const BlockRule& rule, std::vector<Item>& items) {
  parse_items(cursor, declaration.layout, rule, items);
}

// ---- declarations --------------------------------------------------------------------------------------------------
// Each is called after the first word, sets declaration.kind, and leaves the cursor failed after a bad header.

void parse_model(Cursor& cursor, Declaration& declaration) {
  Model model;
  model.name = cursor.expect_name("the name of the model");
  parse_items(cursor, declaration, model_rule(), model.items);
  declaration.kind = std::move(model);
}

void parse_scheme_name(Cursor& cursor, std::optional<Identifier>& scheme) {
  if (cursor.accept_word("with")) scheme = cursor.expect_name("the name of a scheme");
}

void parse_scene(Cursor& cursor, Declaration& declaration) {
  Scene scene;
  scene.name = cursor.expect_name("the name of the scene");
  if (cursor.accept(TokenKind::assign)) {
    scene.like = cursor.expect_name("the name of a scene");
  } else {
    cursor.expect(TokenKind::colon);
    scene.of = cursor.expect_name("the name of a model or program");
    while (cursor.accept(TokenKind::comma)) scene.also.push_back(cursor.expect_name("the name of a model"));
  }
  parse_scheme_name(cursor, scene.scheme);
  parse_items(cursor, declaration, scene_rule(), scene.items);
  declaration.kind = std::move(scene);
}

void parse_scheme(Cursor& cursor, Declaration& declaration) {
  Scheme scheme;
  scheme.name = cursor.expect_name("the name of the scheme");
  parse_items(cursor, declaration, scheme_rule(), scheme.items);
  declaration.kind = std::move(scheme);
}

/// NAME: SCENE with SCHEME, the header of a task, data set or chart.
template <class Block>
void parse_of_scene(Cursor& cursor, Declaration& declaration, const char* what, const BlockRule& rule) {
  Block block;
  block.name = cursor.expect_name(what);
  cursor.expect(TokenKind::colon);
  block.of = cursor.expect_name("the name of a scene");
  parse_scheme_name(cursor, block.scheme);
  parse_items(cursor, declaration, rule, block.items);
  declaration.kind = std::move(block);
}

void parse_task(Cursor& cursor, Declaration& declaration) {
  parse_of_scene<Task>(cursor, declaration, "the name of the task", task_rule());
}

void parse_data_set(Cursor& cursor, Declaration& declaration) {
  parse_of_scene<DataSet>(cursor, declaration, "the name of the data set", data_set_rule());
}

void parse_chart(Cursor& cursor, Declaration& declaration) {
  parse_of_scene<Chart>(cursor, declaration, "the name of the chart", chart_rule());
}

void parse_kernel(Cursor& cursor, Declaration& declaration) {
  Kernel kernel;
  kernel.name = cursor.expect_name("the name of the kernel");
  kernel.parameters = parse_kernel_parameters(cursor);
  if (cursor.accept_word("on")) {
    kernel.axes = cursor.expect_whole_number();
    if (!cursor.accept_word("axis")) cursor.expect_word("axes");
  }
  parse_items(cursor, declaration, kernel_rule(), kernel.items);
  declaration.kind = std::move(kernel);
}

void parse_program(Cursor& cursor, Declaration& declaration) {
  Program program;
  program.name = cursor.expect_name("the name of the program");
  parse_items(cursor, declaration, program_rule(), program.items);
  declaration.kind = std::move(program);
}

void parse_network(Cursor& cursor, Declaration& declaration) {
  Network network;
  network.name = cursor.expect_name("the name of the network");
  parse_signature(cursor, network);
  parse_items(cursor, declaration, network_rule(), network.items);
  declaration.kind = std::move(network);
}

void parse_loop(Cursor& cursor, Declaration& declaration) {
  Loop loop;
  loop.counter = cursor.expect_name("the name of the counter");
  cursor.expect_word("in");
  loop.from = cursor.expect_whole_number();
  cursor.expect(TokenKind::dot_dot);
  loop.to = cursor.expect_whole_number();
  parse_block(cursor, declaration.layout, "loop", [&] {
    const int start = cursor.position();
    Identifier program = cursor.expect_name("the name of a program");
    if (!cursor.at_end_of_item()) cursor.fail_expected("the end of the line or ';'");
    if (cursor.failed()) {
      cursor.recover(start);
    } else {
      loop.body.push_back(std::move(program));
    }
  });
  declaration.kind = std::move(loop);
}

/// adjoint u_bar = ..., after a line break or `;`.
bool begins_adjoint(const Cursor& cursor) {
  const bool is_behind = cursor.at(TokenKind::line_break) || cursor.at(TokenKind::semicolon);
  return cursor.at_word("adjoint") || (is_behind && cursor.peek_second().spelling == "adjoint");
}

/// name(a, b), optional order 2, = expr, and optional adjoints below an operator
void parse_definition(Cursor& cursor, Declaration& declaration, const char* what, bool has_order) {
  Function function;
  function.name = cursor.expect_name(what);
  const Token open = cursor.peek();
  cursor.expect(TokenKind::left_paren);
  cursor.begin_group(open);
  function.parameters = parse_names(cursor, "the name of a parameter");
  cursor.end_group(TokenKind::right_paren);
  if (has_order) {
    cursor.expect_word("order");
    function.order = cursor.expect_whole_number();
  }
  cursor.expect(TokenKind::assign);
  function.body = parse_expression(cursor);
  cursor.expect_end_of_item();
  while (has_order && !cursor.failed() && begins_adjoint(cursor)) {
    while (!cursor.accept_word("adjoint")) cursor.take();
    function.adjoints.push_back(parse_adjoint(cursor));
    cursor.expect_end_of_item();
  }
  if (cursor.failed()) return;
  cursor.collect_inner_comments(declaration.trivia);
  declaration.trivia.after = cursor.take_comment_behind();
  declaration.kind = std::move(function);
}

void parse_function(Cursor& cursor, Declaration& declaration) {
  parse_definition(cursor, declaration, "the name of the function", false);
}

void parse_operator(Cursor& cursor, Declaration& declaration) {
  parse_definition(cursor, declaration, "the name of the operator", true);
}

/// "flow.dpde"
void parse_import(Cursor& cursor, Declaration& declaration) {
  const Token path = cursor.peek();
  if (!cursor.accept(TokenKind::text)) {
    cursor.fail_expected("the name of a file in quotes", "write import \"flow.dpde\"");
    return;
  }
  cursor.expect_end_of_item();
  if (cursor.failed()) return;
  declaration.trivia.after = cursor.take_comment_behind();
  declaration.kind = Import{std::string(path.spelling), path.range};
}

struct DeclarationRule {
  std::string_view word;
  void (*parse)(Cursor&, Declaration&);
};
constexpr DeclarationRule declaration_rules[] = {
    {"model", parse_model},       {"scene", parse_scene},     {"scheme", parse_scheme},    {"task", parse_task},
    {"kernel", parse_kernel},     {"program", parse_program}, {"loop", parse_loop},        {"function", parse_function},
    {"operator", parse_operator}, {"network", parse_network}, {"dataset", parse_data_set}, {"import", parse_import},
    {"chart", parse_chart},
};

void refuse_declaration(Cursor& cursor) {
  const std::vector<std::string> words = words_of_declarations();
  const std::string list = fmt::format("understood here: {}", fmt::join(words, ", "));
  const Token token = cursor.peek();
  if (token.kind != TokenKind::identifier) {
    cursor.fail_expected("a block such as model or scene", list);
    return;
  }
  const std::string near = nearest_name(token.spelling.substr(0, 40), words);
  cursor.fail("unknown-declaration", token.range, {quoted(token.spelling)},
              near.empty() ? list : fmt::format("did you mean {}? {}", near, list));
}

void add_declaration(Cursor& cursor, const SourceFile& source, Declaration declaration,
                     std::vector<Declaration>& declarations) {
  const int start = cursor.position();
  const auto rule = std::find_if(std::begin(declaration_rules), std::end(declaration_rules),
                                 [&](const DeclarationRule& candidate) { return cursor.at_word(candidate.word); });
  if (rule == std::end(declaration_rules)) {
    refuse_declaration(cursor);
  } else {
    cursor.take();
    rule->parse(cursor, declaration);
  }
  if (cursor.failed()) {
    cursor.skip_declaration(start);
    return;
  }
  declaration.range = cursor.range_since(start);
  declaration.imported = source.is_imported(declaration.range.begin);
  declarations.push_back(std::move(declaration));
}

}  // namespace

std::vector<std::string> words_of_declarations() {
  std::vector<std::string> words;
  for (const DeclarationRule& rule : declaration_rules) words.emplace_back(rule.word);
  return words;
}

void parse_items(Cursor& cursor, BlockLayout& layout, const BlockRule& rule, std::vector<Item>& items) {
  parse_block(cursor, layout, rule.name, [&] { add_item(cursor, rule, items); });
}

File parse(const SourceFile& source, DiagnosticSink& sink) {
  Cursor cursor(source, sink);
  File file;
  while (true) {
    cursor.skip_separators();
    Declaration declaration;
    declaration.trivia = cursor.take_comments_above();
    if (cursor.at(TokenKind::end_of_file)) {
      file.trailing_comments = closing_comments(std::move(declaration.trivia), file.declarations.empty());
      return file;
    }
    if (file.declarations.empty()) declaration.trivia.blank_before = false;
    add_declaration(cursor, source, std::move(declaration), file.declarations);
  }
}

Expr parse_expression(const SourceFile& source, DiagnosticSink& sink) {
  Cursor cursor(source, sink);
  cursor.skip_separators();
  Expr expr = parse_expression(cursor);
  if (!cursor.failed()) cursor.skip_separators();
  if (!cursor.at(TokenKind::end_of_file)) cursor.fail_expected("the end of the expression", cursor.product_hint());
  return cursor.failed() ? Expr() : expr;
}

}  // namespace dpde::ast
