// SPDX-License-Identifier: Apache-2.0
// Parses units after the word in, and names with units.
#include <algorithm>
#include <initializer_list>

#include "support/names/units.h"
#include "syntax/parse/parse_parts.h"

namespace dpde::ast {

UnitText parse_unit(Cursor& cursor) {
  if (!cursor.accept_word("in")) return std::nullopt;
  const int first = cursor.position();
  const auto at_one_of = [&](std::initializer_list<TokenKind> kinds) {
    return std::ranges::find(kinds, cursor.peek().kind) != kinds.end();
  };
  std::string text;
  int open = 0;
  for (bool wants_name = true;;) {
    const bool is_name = at_one_of({TokenKind::identifier, TokenKind::number});
    const bool closes = open > 0 && cursor.at(TokenKind::right_paren);
    const bool fits = wants_name ? is_name || at_one_of({TokenKind::left_paren, TokenKind::minus})
                                 : closes || at_one_of({TokenKind::star, TokenKind::slash, TokenKind::caret});
    const bool is_power = wants_name && text.ends_with('*') && cursor.at(TokenKind::star);  // m**2
    if (!fits && !is_power) break;
    if (cursor.at(TokenKind::left_paren)) ++open;
    if (closes) --open;
    wants_name = !is_name && !closes;
    text += cursor.take().spelling;
    if (is_power && cursor.at(TokenKind::number)) cursor.take();
    if (is_power) break;
  }
  if (text.empty()) {
    cursor.fail_expected("a unit", "as in: in m/s");
    return std::nullopt;
  }
  Identifier unit{std::move(text), cursor.range_since(first)};
  const auto read = read_unit(unit.name);
  const auto* mistake = std::get_if<UnitMistake>(&read);
  if (mistake == nullptr) return unit;
  cursor.error("unknown-unit", unit.range, {mistake->part.substr(0, 40)}, mistake->hint);
  return std::nullopt;
}

Declared parse_declared(Cursor& cursor, const char* what, bool may_lie_somewhere) {
  Declared all;
  const auto take_unit = [&] {
    const UnitText unit = parse_unit(cursor);
    for (std::size_t i = all.units.size(); unit && i-- > 0 && !all.units[i];) all.units[i] = unit;
  };
  do {
    all.names.push_back(cursor.expect_element(what));
    all.units.emplace_back();
    take_unit();
  } while (cursor.accept(TokenKind::comma));
  if (may_lie_somewhere) all.on = parse_placement(cursor);
  if (all.on) take_unit();
  return all;
}

}  // namespace dpde::ast
