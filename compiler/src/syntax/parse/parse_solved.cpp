// SPDX-License-Identifier: Apache-2.0
// Parses constraints and equations that are solved at each time.
#include <string>
#include <utility>

#include "syntax/parse/parse_parts.h"

namespace dpde::ast {

namespace {

/// left = right WORD name
struct Related {
  Expr left, right;
  Identifier name;
};
Related parse_related(Cursor& cursor, const char* word, const char* what, std::string hint = {}) {
  Related related{parse_expression(cursor), {}, {}};
  cursor.expect(TokenKind::assign);
  related.right = parse_expression(cursor);
  cursor.expect_word(word, std::move(hint));
  return {related.left, related.right, cursor.expect_name(what)};
}

/// from guess(omega), psi_before
std::vector<Expr> parse_starts(Cursor& cursor) {
  std::vector<Expr> starts;
  for (bool more = cursor.accept_word("from"); more; more = cursor.accept(TokenKind::comma))
    starts.push_back(parse_expression(cursor));
  return starts;
}

/// preconditioner smooth(residual)
std::optional<Expr> parse_preconditioner(Cursor& cursor) {
  return cursor.accept_word("preconditioner") ? std::optional(parse_expression(cursor)) : std::nullopt;
}

/// each step, each stage
std::optional<Identifier> parse_each(Cursor& cursor) {
  if (!cursor.accept_word("each")) return std::nullopt;
  if (cursor.at_word("step") || cursor.at_word("stage")) return cursor.expect_name("step or stage");
  cursor.fail_expected("step or stage", "0 = div(u) gives p each step");
  return std::nullopt;
}

}  // namespace

ItemKind parse_solved(Cursor& cursor) {
  Related related = parse_related(cursor, "for", "the field that is sought");
  SolvedItem item{related.left, related.right, related.name, parse_unit(cursor), parse_starts(cursor)};
  item.preconditioner = parse_preconditioner(cursor);
  if (!cursor.accept_word("after")) return item;
  item.iterations = cursor.expect_whole_number();
  cursor.expect_word("iterations");
  return item;
}

ItemKind parse_constraint(Cursor& cursor) {
  Related related = parse_related(cursor, "gives", "the field that the constraint gives",
                                  "0 = div(u) gives p; an equation without dt is solved: solve lap(u) = -f for u");
  ConstraintItem item{related.left, related.right, related.name};
  item.each = parse_each(cursor);
  item.starts = parse_starts(cursor);
  item.preconditioner = parse_preconditioner(cursor);
  return item;
}

}  // namespace dpde::ast
