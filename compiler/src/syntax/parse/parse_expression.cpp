// SPDX-License-Identifier: Apache-2.0
// Precedence climbing. Two limits keep later recursion over a tree within the stack: the nesting depth of the text
// (parentheses, unary operators, right operands) and the height of the tree (a long chain a + a + a is left-deep).
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "support/vocabulary.h"
#include "syntax/parse/parse_parts.h"

namespace dpde::ast {
namespace {

constexpr int max_nesting = 200;
constexpr int max_height = 1500;
constexpr const char* shorten_hint = "give a part of it a name with let";

/// An expression, its range with parentheses, and the height of its tree.
struct Parsed {
  Expr expr;
  SourceRange range;
  int height = 1;
};

struct Operator {
  TokenKind kind;
  BinaryOp op;
};
constexpr Operator operators[] = {
    {TokenKind::plus, BinaryOp::add},
    {TokenKind::minus, BinaryOp::subtract},
    {TokenKind::star, BinaryOp::multiply},
    {TokenKind::slash, BinaryOp::divide},
    {TokenKind::caret, BinaryOp::power},
    {TokenKind::less, BinaryOp::less},
    {TokenKind::less_equal, BinaryOp::less_equal},
    {TokenKind::greater, BinaryOp::greater},
    {TokenKind::greater_equal, BinaryOp::greater_equal},
    {TokenKind::equal, BinaryOp::equal},
    {TokenKind::not_equal, BinaryOp::not_equal},
};
constexpr int comparison_precedence = 3;

std::optional<BinaryOp> binary_operator(const Token& token) {
  if (token.kind == TokenKind::identifier && token.spelling == "and") return BinaryOp::logical_and;
  if (token.kind == TokenKind::identifier && token.spelling == "or") return BinaryOp::logical_or;
  const auto* found = std::find_if(std::begin(operators), std::end(operators),
                                   [&](const Operator& candidate) { return candidate.kind == token.kind; });
  if (found == std::end(operators)) return std::nullopt;
  return found->op;
}

class ExpressionParser {
 public:
  explicit ExpressionParser(Cursor& cursor) : cursor_(cursor) {}

  Parsed binary(int lowest) {
    if (++nesting_ > max_nesting) cursor_.fail("nesting-too-deep", cursor_.peek().range, {}, shorten_hint);
    Parsed left = cursor_.failed() ? Parsed{} : prefix();
    bool compared = false;
    for (auto op = binary_operator(cursor_.peek()); op && precedence(*op) >= lowest;
         op = binary_operator(cursor_.peek())) {
      const bool compares = precedence(*op) == comparison_precedence;
      if (compares && compared) {
        cursor_.fail("chained-comparison", cursor_.peek().range, {}, "write a < b and b < c");
        break;
      }
      compared = compared || compares;
      cursor_.take();
      Parsed right = binary(*op == BinaryOp::power ? precedence(*op) : precedence(*op) + 1);
      const int height = std::max(left.height, right.height) + 1;
      const SourceRange range{left.range.begin, right.range.end};
      left = checked({Expr(Node{Binary{*op, left.expr, right.expr}, range}), range, height});
    }
    --nesting_;
    return left;
  }

  /// Parses a call, starting at `(`.
  Parsed call(const Identifier& callee) {
    const Token open = cursor_.take();
    Call call{callee.name, callee.range, {}};
    int height = 1;
    cursor_.begin_group(open);
    if (!cursor_.at(TokenKind::right_paren)) {
      do {
        call.arguments.push_back(argument(height));
      } while (cursor_.accept(TokenKind::comma));
    }
    close(TokenKind::right_paren);
    return finish(std::move(call), callee.range.begin, height + 1);
  }

  /// 5, or rate = 5. `height` becomes the maximum with that of the argument.
  Argument argument(int& height) {
    Argument argument;
    if (cursor_.at(TokenKind::identifier) && cursor_.peek_second().kind == TokenKind::assign) {
      Identifier name = cursor_.expect_name("the name of an argument");
      argument.name = std::move(name.name);
      argument.name_range = name.range;
      cursor_.expect(TokenKind::assign);
    }
    const Parsed value = binary(1);
    argument.value = value.expr;
    height = std::max(height, value.height);
    return argument;
  }

 private:
  Parsed checked(Parsed parsed) {
    if (parsed.height > max_height) cursor_.fail("nesting-too-deep", cursor_.peek().range, {}, shorten_hint);
    return cursor_.failed() ? Parsed{} : parsed;
  }

  Parsed finish(Kind kind, int begin, int height) {
    const SourceRange range{begin, cursor_.behind_last().end};
    return checked({Expr(Node{std::move(kind), range}), range, height});
  }

  Parsed prefix() {
    const bool is_not = cursor_.at_word("not");
    if (!is_not && !cursor_.at(TokenKind::minus)) return primary();
    const int begin = cursor_.take().range.begin;
    // -x^2 is -(x^2); not a < b is not (a < b)
    Parsed operand = binary(is_not ? comparison_precedence : unary_precedence);
    const UnaryOp op = is_not ? UnaryOp::logical_not : UnaryOp::negate;
    return finish(Unary{op, operand.expr}, begin, operand.height + 1);
  }

  Parsed primary() {
    const Token token = cursor_.peek();
    const int begin = token.range.begin;
    if (token.kind == TokenKind::left_paren) return component(group());
    if (token.kind == TokenKind::bar) return magnitude();
    if (token.kind == TokenKind::identifier) return name();
    if (cursor_.accept(TokenKind::number)) return finish(Number{token.value, std::string(token.spelling)}, begin, 1);
    if (cursor_.accept(TokenKind::text)) return finish(Text{std::string(token.spelling)}, begin, 1);
    const bool is_power = token.kind == TokenKind::star;  // u**2
    cursor_.fail_expected("an expression", is_power ? "a power is written u^2, a product u*v" : "");
    return {};
  }

  Parsed name() {
    const Identifier name = cursor_.expect_component("an expression");
    if (cursor_.at(TokenKind::left_paren)) return component(call(name));
    if (cursor_.at(TokenKind::left_bracket)) return offsets(name);
    return finish(Name{name.name}, name.range.begin, 1);
  }

  /// .x after a call or parentheses.
  Parsed component(Parsed of) {
    if (!cursor_.accept(TokenKind::dot)) return of;
    Identifier name = cursor_.expect_name("the name of a component, as in grad(u).x");
    return finish(Component{of.expr, std::move(name)}, of.range.begin, of.height + 1);
  }

  Parsed group() {
    const Token open = cursor_.take();
    cursor_.begin_group(open);
    Parsed first = binary(1);
    std::vector<Expr> elements{first.expr};
    int height = first.height;
    while (cursor_.accept(TokenKind::comma)) {
      const Parsed element = binary(1);
      elements.push_back(element.expr);
      height = std::max(height, element.height);
    }
    close(TokenKind::right_paren);
    const SourceRange range{open.range.begin, cursor_.behind_last().end};
    if (elements.size() == 1) return checked({first.expr, range, first.height});
    return finish(Tuple{std::move(elements)}, range.begin, height + 1);
  }

  /// |u|: a bar in operand position opens, any other closes.
  Parsed magnitude() {
    const Token open = cursor_.take();
    cursor_.begin_group(open);
    const Parsed operand = binary(1);
    if (!cursor_.at(TokenKind::bar)) cursor_.fail_expected("the closing '|'", cursor_.product_hint());
    cursor_.end_group(TokenKind::bar);
    return finish(Unary{UnaryOp::magnitude, operand.expr}, open.range.begin, operand.height + 1);
  }

  void close(TokenKind kind) {
    if (!cursor_.at(kind)) cursor_.fail_expected(fmt::format("',' or {}", name_of(kind)), cursor_.product_hint());
    cursor_.end_group(kind);
  }

  /// u[+1, 0] and inside[-1] grow 1, starting at `[`; A[i, 2] with a name as index is an element's name.
  Parsed offsets(const Identifier& name) {
    const Token open = cursor_.take();
    Offsets offsets{name.name, {}, 0, false};
    std::string element = name.name;
    bool has_names = false;
    cursor_.begin_group(open);
    do {
      element += element.size() == name.name.size() ? "[" : ", ";
      offsets.has_signs = offsets.has_signs || cursor_.at(TokenKind::plus) || cursor_.at(TokenKind::minus);
      const bool is_name = cursor_.at(TokenKind::identifier);
      has_names = has_names || is_name;
      if (!is_name) offsets.offsets.push_back(cursor_.expect_whole_number());
      offsets.has_signs = offsets.has_signs || (!is_name && offsets.offsets.back() < 1);  // no element has index 0
      element += is_name ? cursor_.expect_name("an index").name : std::to_string(offsets.offsets.back());
    } while (cursor_.accept(TokenKind::comma));
    cursor_.end_group(TokenKind::right_bracket);
    if (has_names) return finish(Name{element + "]"}, name.range.begin, 1);
    if (name.name == "inside" && cursor_.accept_word("grow")) offsets.grow = cursor_.expect_whole_number();
    return finish(std::move(offsets), name.range.begin, 1);
  }

  Cursor& cursor_;
  int nesting_ = 0;
};

}  // namespace

Expr parse_expression(Cursor& cursor) { return ExpressionParser(cursor).binary(1).expr; }

Argument parse_argument(Cursor& cursor) {
  int height = 0;
  return ExpressionParser(cursor).argument(height);
}

Expr parse_call(Cursor& cursor, const Identifier& callee) { return ExpressionParser(cursor).call(callee).expr; }

}  // namespace dpde::ast
