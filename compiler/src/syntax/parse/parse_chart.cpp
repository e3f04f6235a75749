// SPDX-License-Identifier: Apache-2.0
// Parses items of charts.
#include "syntax/parse/parse_parts.h"

namespace dpde::ast {
namespace {

ItemKind parse_reference(Cursor& cursor) {
  if (cursor.at_end_of_item()) cursor.fail_expected("'exact', or self(cells = ...)");
  return ReferenceItem{parse_expression(cursor)};
}

std::vector<Expr> parse_values(Cursor& cursor) {
  std::vector<Expr> values;
  do {
    values.push_back(parse_expression(cursor));
  } while (cursor.accept(TokenKind::comma));
  return values;
}

/// advect in central(2), upwind(3)
ItemKind parse_choices(Cursor& cursor) {
  ChoicesItem item;
  item.key = cursor.expect_name("scheme, cells, step, fraction or a key of a scheme");
  cursor.expect_word("in");
  item.values = parse_values(cursor);
  return item;
}

/// l2(u), linf(v) at t = 1
ItemKind parse_error(Cursor& cursor) {
  ErrorItem item;
  item.norms = parse_values(cursor);
  if (!cursor.accept_word("at")) return item;
  cursor.expect_word("t");
  cursor.expect(TokenKind::assign);
  item.at = parse_expression(cursor);
  return item;
}

ItemKind parse_gradient(Cursor& cursor) { return OptionItem{{"gradient", {}}, parse_expression(cursor)}; }
ItemKind parse_tolerance(Cursor& cursor) { return OptionItem{{"tolerance", {}}, parse_expression(cursor)}; }

}  // namespace

BlockRule chart_rule() {
  return {"chart",
          {{"reference", parse_reference},
           {"vary", parse_choices},
           {"error", parse_error},
           {"gradient", parse_gradient},
           {"tolerance", parse_tolerance}},
          {}};
}

}  // namespace dpde::ast
