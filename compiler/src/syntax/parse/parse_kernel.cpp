// SPDX-License-Identifier: Apache-2.0
// Parses headers and items of kernels, and items of programs.
#include <fmt/format.h>

#include <algorithm>

#include "syntax/parse/parse_parts.h"

namespace dpde::ast {
namespace {

struct RolePrefix {
  KernelRole role;
  std::string_view word;
};
constexpr RolePrefix role_prefixes[] = {
    {KernelRole::out, "out"}, {KernelRole::inout, "inout"}, {KernelRole::sum, "sum"}};

/// out v, w: field — a prefix applies to all names of its group.
const RolePrefix* accept_prefix(Cursor& cursor) {
  if (cursor.peek_second().kind != TokenKind::identifier) return nullptr;
  for (const RolePrefix& prefix : role_prefixes) {
    if (cursor.accept_word(prefix.word)) return &prefix;
  }
  return nullptr;
}

/// The type after the colon; together with the prefix it determines the role.
KernelRole parse_role(Cursor& cursor, const RolePrefix* prefix) {
  const bool is_param = cursor.at_word("param");
  if (!is_param && !cursor.at_word("field")) cursor.fail_expected("'field' or 'param'");
  const bool wants_param = prefix != nullptr && prefix->role == KernelRole::sum;
  if (prefix != nullptr && wants_param != is_param) {
    cursor.fail("bad-role", cursor.peek().range, {std::string(prefix->word), wants_param ? "param" : "field"});
  }
  cursor.take();
  if (prefix != nullptr) return prefix->role;
  return is_param ? KernelRole::param : KernelRole::in;
}

void parse_group(Cursor& cursor, std::vector<KernelParameter>& parameters) {
  const RolePrefix* prefix = accept_prefix(cursor);
  const std::vector<Identifier> names = parse_components(cursor, "the name of a field or param");
  cursor.expect(TokenKind::colon);
  const KernelRole role = parse_role(cursor, prefix);
  std::optional<int> halo;
  const bool is_field = role != KernelRole::param && role != KernelRole::sum;
  if (is_field && cursor.accept_word("halo")) halo = cursor.expect_whole_number();
  for (const Identifier& name : names) parameters.push_back({name, role, halo});
}

// ---- kernel --------------------------------------------------------------------------------------------------------
bool begins_assignment(const Cursor& cursor) {
  const TokenKind second = cursor.peek_second().kind;
  return cursor.at(TokenKind::identifier) && (second == TokenKind::assign || second == TokenKind::plus_assign ||
                                              second == TokenKind::left_paren || second == TokenKind::dot);
}

ItemKind parse_local(Cursor& cursor) {
  auto [name, value] = parse_component_definition(cursor, "a name");
  return LetItem{std::move(name), std::move(value)};
}

ItemKind parse_assignment(Cursor& cursor) {
  const Identifier target = cursor.expect_component("the name of a field");
  if (cursor.at(TokenKind::left_paren)) {
    ScatterItem item;
    item.target = parse_call(cursor, target);
    cursor.expect(TokenKind::plus_assign);
    item.value = parse_expression(cursor);
    return item;
  }
  const bool accumulate = cursor.accept(TokenKind::plus_assign);
  if (!accumulate) cursor.expect(TokenKind::assign);
  return AssignItem{target, accumulate, parse_expression(cursor)};
}

}  // namespace

AdjointItem parse_adjoint(Cursor& cursor) {
  AdjointItem item;
  item.target = cursor.expect_component("the adjoint of an input, as u_bar");
  item.accumulate = cursor.accept(TokenKind::plus_assign);
  if (!item.accumulate) cursor.expect(TokenKind::assign);
  item.value = parse_expression(cursor);
  return item;
}

namespace {

// ---- program -------------------------------------------------------------------------------------------------------
ItemKind parse_fill(Cursor& cursor) {
  const Identifier field = cursor.expect_component("the name of a field");
  return FillItem{field, false, 0, parse_sides(cursor)};
}

ItemKind parse_fold(Cursor& cursor) {
  const Identifier field = cursor.expect_component("the name of a field");
  const bool grows = cursor.at_word("grow") && cursor.peek_second().kind == TokenKind::number;
  if (grows) cursor.take();
  const int grow = grows ? cursor.expect_whole_number() : 0;
  return FillItem{field, true, grow, parse_sides(cursor)};
}

ItemKind parse_reduce(Cursor& cursor) {
  ReduceItem item;
  item.result = cursor.expect_component("the name of a field");
  cursor.expect(TokenKind::assign);
  const auto kind = find_reduction(cursor.peek().spelling);
  if (!kind) {
    cursor.fail_expected("'mean', 'sum', 'max' or 'min'");
    return item;
  }
  cursor.take();
  item.kind = *kind;
  item.field = cursor.expect_component("the name of a field");
  if (!cursor.accept_word("over")) return item;
  do {
    item.axes.push_back(cursor.expect_name("an axis: x, y or z"));
  } while (cursor.accept(TokenKind::comma));
  return item;
}

ItemKind parse_transform(Cursor& cursor) {
  TransformItem item;
  do {
    TransformItem::Term term{cursor.expect_component("the name of a field"), {}};
    cursor.expect_word("by");
    term.by = parse_expression(cursor);
    term.within_two_thirds = cursor.accept_word("within");
    if (term.within_two_thirds) cursor.expect_word("two_thirds");
    item.terms.push_back(std::move(term));
  } while (cursor.accept(TokenKind::comma));
  cursor.expect_word("to");
  item.result = cursor.expect_component("the name of a field");
  return item;
}

ItemKind parse_run(Cursor& cursor) {
  RunItem item;
  item.kernel = cursor.expect_name("the name of a kernel");
  if (cursor.accept_word("grow")) item.grow = cursor.expect_whole_number();
  return item;
}

ItemKind parse_swap(Cursor& cursor) {
  SwapItem item;
  item.state = cursor.expect_component("the name of a field");
  cursor.expect(TokenKind::comma);
  item.next = cursor.expect_component("the name of a field");
  return item;
}

template <bool is_save>
ItemKind parse_stack(Cursor& cursor) {
  StackItem item{cursor.expect_component("the name of a field"), {}, is_save};
  cursor.expect_word(is_save ? "in" : "from");
  item.stack = cursor.expect_component("the name of a stack");
  return item;
}

ItemKind parse_repeated(Cursor& cursor) {
  RepeatItem item = parse_repeat(cursor, repeat_rule());
  if (cursor.accept_word("to")) item.to = parse_components(cursor, "the name of a field");
  return item;
}

BlockRule operator_rule();

/// A method's name, or a network: smooth(r, k) to d
void parse_preconditioner_of(Cursor& cursor, SolveItem& item) {
  const Identifier name = cursor.expect_name("a preconditioner, as none or network(r) to d");
  const Token open = cursor.peek();
  if (!cursor.accept(TokenKind::left_paren)) {
    item.preconditioner = name;
    return;
  }
  cursor.begin_group(open);
  NetworkUse use{name, parse_components(cursor, "the name of a field"), {}};
  cursor.end_group(TokenKind::right_paren);
  cursor.expect_word("to");
  use.to = {cursor.expect_component("the name of a field")};
  item.network = std::move(use);
}

template <bool is_linear>
ItemKind parse_solve(Cursor& cursor) {
  SolveItem item{.is_linear = is_linear};
  item.images = parse_components(cursor, "the field that the block makes");
  cursor.expect(TokenKind::assign);
  item.rights = parse_components(cursor, "the field that it shall be");
  cursor.expect_word("for");
  item.unknowns = parse_components(cursor, "the field that is sought");
  if (cursor.accept_word("from")) {
    do item.guesses.push_back(cursor.expect_name("a field that it begins with"));
    while (cursor.accept(TokenKind::comma));
  }
  if (cursor.accept_word("by")) item.method = cursor.expect_name("a method, as multigrid");
  if (cursor.accept_word("smoother")) item.smoother = cursor.expect_name("a smoother of multigrid, as jacobi");
  if (cursor.accept_word("preconditioner")) parse_preconditioner_of(cursor, item);
  if (cursor.accept_word("tolerance")) item.tolerance = parse_expression(cursor);
  if (cursor.accept_word("iterations")) item.iterations = parse_expression(cursor);
  item.warns = cursor.accept_word("or");
  if (item.warns) cursor.expect_word("warn");
  if (!cursor.begin_block(max_blocks_inside))
    cursor.fail("repeats-too-deep", item.unknowns.front().range, {std::to_string(max_blocks_inside)});
  parse_items(cursor, item.layout, operator_rule(), item.items);
  cursor.end_block();
  return item;
}

/// corrector(a, b), then `by` and `to` with fields, depending on the mode.
template <ApplyItem::Mode mode>
ItemKind parse_apply(Cursor& cursor) {
  constexpr const char* what = "the name of a field, or _ for none";
  ApplyItem item{cursor.expect_name("the name of a network"), mode, {}, {}, {}};
  const Token open = cursor.peek();
  cursor.expect(TokenKind::left_paren);
  cursor.begin_group(open);
  item.inputs = parse_components(cursor, "the name of a field");
  cursor.end_group(TokenKind::right_paren);
  if (mode != ApplyItem::Mode::value) {
    cursor.expect_word("by");
    item.by = parse_components(cursor, what);
  }
  cursor.expect_word("to");
  item.to = parse_components(cursor, mode == ApplyItem::Mode::value ? "the name of a field" : what);
  if (mode != ApplyItem::Mode::value) item.weights = cursor.accept_word("weights");
  return item;
}

ItemKind parse_keep(Cursor& cursor) { return KeepItem{parse_components(cursor, "the name of a field")}; }

ItemKind parse_axes(Cursor& cursor) {
  AxesItem item;
  do {
    AxesItem::Axis axis{cursor.expect_name("an axis: x, y or z"), Topology::periodic};
    if (cursor.accept_word("bounded")) {
      axis.topology = Topology::bounded;
    } else if (!cursor.accept_word("periodic")) {
      cursor.fail_expected("'periodic' or 'bounded'");
    }
    item.axes.push_back(std::move(axis));
  } while (cursor.accept(TokenKind::comma));
  return item;
}

/// k in 0 .. 8, or 8 .. 0
void parse_counter(Cursor& cursor, RepeatItem& item) {
  item.counter = cursor.expect_name("the name of the counter");
  cursor.expect_word("in");
  const int start = cursor.position();
  const int from = cursor.expect_whole_number();
  cursor.expect(TokenKind::dot_dot);
  const int to = cursor.expect_whole_number();
  item.count_range = cursor.range_since(start);
  item.is_backwards = to == 0;
  item.count = std::max(from, to);
  if (!cursor.failed() && (std::min(from, to) != 0 || item.count == 0))
    cursor.fail("bad-repeat", item.count_range, {"0 .. n or n .. 0", fmt::format("{} .. {}", from, to)},
                "count from 0 up, or down to 0: n passes have the numbers 0 to n - 1");
}

}  // namespace

RepeatItem parse_repeat(Cursor& cursor, const BlockRule& rule, std::string_view shared) {
  RepeatItem item;
  const int start = cursor.position();
  if (shared.empty() && cursor.at(TokenKind::identifier)) {
    parse_counter(cursor, item);
  } else {
    item.count = cursor.expect_whole_number();
    item.count_range = cursor.range_since(start);
  }
  item.shared = !shared.empty() && cursor.accept_word(shared);
  if (!cursor.begin_block(max_blocks_inside)) {
    cursor.fail("repeats-too-deep", item.count_range, {std::to_string(max_blocks_inside)});
  }
  parse_items(cursor, item.layout, rule, item.items);
  cursor.end_block();
  return item;
}

std::vector<KernelParameter> parse_kernel_parameters(Cursor& cursor) {
  std::vector<KernelParameter> parameters;
  const Token open = cursor.peek();
  if (!cursor.expect(TokenKind::left_paren)) return parameters;
  cursor.begin_group(open);
  if (!cursor.at(TokenKind::right_paren)) {
    do {
      parse_group(cursor, parameters);
    } while (cursor.accept(TokenKind::comma));
  }
  cursor.end_group(TokenKind::right_paren);
  return parameters;
}

BlockRule kernel_rule() {
  return {"kernel",
          {{"let", parse_local}, {"adjoint", [](Cursor& cursor) -> ItemKind { return parse_adjoint(cursor); }}},
          {begins_assignment, parse_assignment, "field = value, sum += value"}};
}

BlockRule repeat_rule() {
  return {"repeat",
          {{"fill", parse_fill},
           {"fold", parse_fold},
           {"reduce", parse_reduce},
           {"run", parse_run},
           {"transform", parse_transform},
           {"apply", parse_apply<ApplyItem::Mode::value>},
           {"tangent", parse_apply<ApplyItem::Mode::tangent>},
           {"adjoint", parse_apply<ApplyItem::Mode::adjoint>},
           {"second", parse_apply<ApplyItem::Mode::second>},
           {"repeat", parse_repeated},
           {"solve", parse_solve<true>},
           {"newton", parse_solve<false>},
           {"save", parse_stack<true>},
           {"load", parse_stack<false>},
           {"swap", parse_swap}},
          {}};
}

namespace {

/// Items of solves: their blocks contain no steps.
BlockRule operator_rule() {
  BlockRule rule = repeat_rule();
  rule.name = "solve";
  std::erase_if(rule.items, [](const ItemRule& item) {
    return item.word == "save" || item.word == "load" || item.word == "swap" || item.word == "apply" ||
           item.word == "tangent" || item.word == "adjoint" || item.word == "second";
  });
  return rule;
}

}  // namespace

BlockRule program_rule() {
  BlockRule rule = repeat_rule();
  rule.name = "program";
  std::erase_if(rule.items, [](const ItemRule& item) { return item.word == "save" || item.word == "load"; });
  rule.items.push_back({"keep", parse_keep});
  rule.items.push_back({"axes", parse_axes});
  return rule;
}

}  // namespace dpde::ast
