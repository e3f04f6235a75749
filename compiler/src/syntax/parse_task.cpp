// SPDX-License-Identifier: Apache-2.0
// The items of tasks.
#include <tuple>

#include "syntax/parse_parts.h"

namespace dpde::ast {
namespace {

/// at t = 0.5, 1.0, over time, or nothing.
When parse_when(Cursor& cursor) {
  if (cursor.accept_word("over")) {
    cursor.expect_word("time");
    return WhenOver{};
  }
  if (!cursor.accept_word("at")) return WhenEnd{};
  WhenAt when;
  cursor.expect_word("t");
  cursor.expect(TokenKind::assign);
  do {
    when.times.push_back(parse_expression(cursor));
  } while (cursor.accept(TokenKind::comma));
  return when;
}

ItemKind parse_data(Cursor& cursor) {
  DataItem item;
  item.name = cursor.expect_name("a name for the data");
  item.on = parse_placement(cursor);
  cursor.expect(TokenKind::assign);
  item.value = parse_expression(cursor);
  if (cursor.accept_word("from")) {
    cursor.expect_word("scene");
    item.scene = cursor.expect_name("the name of a scene");
  }
  item.when = parse_when(cursor);
  return item;
}

ItemKind parse_unknown(Cursor& cursor) {
  UnknownItem item;
  const Token& second = cursor.peek_second();
  const bool names_a_field = second.kind == TokenKind::identifier && second.spelling != "from";
  if (cursor.at_word("initial") && names_a_field) {
    cursor.take();
    item.initial = true;
  }
  constexpr const char* what = "the name of a parameter, or 'initial' and the name of a field";
  item.name = item.initial ? parse_field_or_rate(cursor, what) : cursor.expect_component(what);
  if (cursor.accept_word("from")) item.from = parse_expression(cursor);
  if (cursor.accept_word("in")) {
    item.low = parse_expression(cursor);
    cursor.expect(TokenKind::dot_dot);
    item.high = parse_expression(cursor);
  }
  return item;
}

ItemKind parse_minimise(Cursor& cursor) {
  MinimiseItem item;
  item.loss = parse_expression(cursor);
  item.when = parse_when(cursor);
  return item;
}

ItemKind parse_using(Cursor& cursor) {
  UsingItem item;
  item.optimiser = parse_expression(cursor);
  if (cursor.accept(TokenKind::comma)) {
    cursor.expect_word("iterations");
    item.iterations = parse_expression(cursor);
  }
  return item;
}

ItemKind parse_test(Cursor& cursor) {
  TestItem item;
  std::tie(item.name, item.value) = parse_definition(cursor, "a name for the number");
  item.when = parse_when(cursor);
  return item;
}

}  // namespace

BlockRule task_rule() {
  return {"task",
          {{"data", parse_data},
           {"unknown", parse_unknown},
           {"minimise", parse_minimise},
           {"using", parse_using},
           {"test", parse_test}},
          {}};
}

}  // namespace dpde::ast
