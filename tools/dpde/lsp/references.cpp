// SPDX-License-Identifier: Apache-2.0
#include "lsp/references.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "lsp/cursor_place.h"
#include "lsp/word_texts.h"
#include "syntax/parse/lexer.h"

namespace dpde::lsp {

using ast::Token;
using ast::TokenKind;

namespace {

bool is_identifier(const std::string& text) {
  const auto is_of_word = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; };
  return !text.empty() && std::isdigit(static_cast<unsigned char>(text[0])) == 0 &&
         std::ranges::all_of(text, is_of_word);
}

std::string renamed(const Document& document, const DeclaredName& name, const std::string& wanted) {
  std::string text = document.text();
  std::vector<SourceRange> uses = uses_of(document, name);
  for (auto use = uses.rbegin(); use != uses.rend(); ++use)
    text.replace(static_cast<std::size_t>(use->begin), static_cast<std::size_t>(use->end - use->begin), wanted);
  return text;
}

std::size_t mistakes_in(const std::string& uri, const std::string& text) {
  Document document(uri, false);
  document.set_text(text);
  document.understand(Depth::model);
  return document.diagnostics().size();
}

/// The name before the innermost open parenthesis, and the commas behind that.
struct OpenCall {
  std::string_view function;
  int argument = 0;
};
OpenCall open_call(const std::vector<Token>& before) {
  int depth = 0, commas = 0;
  for (std::size_t i = before.size(); i-- > 0;) {
    const TokenKind kind = before[i].kind;
    if (kind == TokenKind::right_paren) ++depth;
    if (kind == TokenKind::comma && depth == 0) ++commas;
    if (kind != TokenKind::left_paren || depth-- > 0) continue;
    const bool is_call = i > 0 && before[i - 1].kind == TokenKind::identifier;
    return is_call ? OpenCall{before[i - 1].spelling, commas} : OpenCall{};
  }
  return {};
}

/// The first line of a function or operator of the file.
std::string head_of(const Document& document, std::string_view function) {
  for (const DeclaredName& name : document.names()) {
    if (name.name != function || name.block >= 0 || (name.word != "function" && name.word != "operator")) continue;
    const auto begin = static_cast<std::size_t>(name.line.begin);
    return std::string(
        document.whole().text().substr(begin, static_cast<std::size_t>(name.line.end - name.line.begin)));
  }
  return "";
}

}  // namespace

std::vector<SourceRange> uses_of(const Document& document, const DeclaredName& name) {
  DiagnosticSink unheard;
  const std::vector<Token> tokens = ast::lex(document.source(), unheard).tokens;
  std::vector<SourceRange> uses;
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    const bool is_component = i > 0 && tokens[i - 1].kind == TokenKind::dot;
    if (tokens[i].kind != TokenKind::identifier || is_component || tokens[i].spelling != name.name) continue;
    if (document.find(tokens[i].range.begin) == &name) uses.push_back(tokens[i].range);
  }
  return uses;
}

std::string why_not_renamed(const Document& document, int offset, const std::string& wanted) {
  const DeclaredName* name = document.find(offset);
  if (name == nullptr) return "there is no name that this file declares";
  if (document.whole().is_imported(name->range.begin))
    return fmt::format("{} is declared in {}: rename it there", name->name,
                       document.whole().path_of(name->range.begin));
  if (name->word == "axis") return "axes have the names of their coordinates";
  if (!is_identifier(wanted)) return fmt::format("{} is no name: letters, digits and _, a letter first", wanted);
  for (const DeclaredName* other : document.names_at(offset)) {
    if (other->name == wanted) return fmt::format("{} is there already, a {}", wanted, other->word);
  }
  if (mistakes_in(document.uri(), renamed(document, *name, wanted)) != mistakes_in(document.uri(), document.text()))
    return fmt::format("with {} in place of {} the text would have other mistakes than now", wanted, name->name);
  return "";
}

Json signature_help(const Document& document, int offset) {
  const CursorPlace place = cursor_place(document.source(), offset);
  const OpenCall call = open_call(place.before);
  if (place.where == CursorPlace::Where::outside || call.function.empty()) return nullptr;
  Json signature = {{"label", head_of(document, call.function)}};
  if (const WordText* text = text_of_function(call.function))
    signature = {{"label", text->usage}, {"documentation", text->text}};
  if (signature.at("label").get<std::string>().empty()) return nullptr;
  return {{"signatures", Json::array({signature})}, {"activeSignature", 0}, {"activeParameter", call.argument}};
}

}  // namespace dpde::lsp
