// SPDX-License-Identifier: Apache-2.0
// Parses items of tasks.
#include <fmt/format.h>

#include <tuple>

#include "syntax/parse/parse_parts.h"

namespace dpde::ast {
namespace {

When parse_over(Cursor& cursor, std::optional<Identifier> counted) {
  if (cursor.accept_word("time")) return WhenOver{std::move(counted)};
  if (cursor.at_end_of_item()) cursor.fail_expected("'time', or a number of steps");
  WhenSteps when{parse_expression(cursor), std::move(counted)};
  cursor.expect_word("steps");
  return when;
}

/// at t = 0.5, 1.0, over time, over 4 steps, after 4 steps, or empty.
When parse_when(Cursor& cursor) {
  if (cursor.accept_word("over")) return parse_over(cursor, {});
  if (cursor.accept_word("after")) {
    WhenSteps when{parse_expression(cursor), {}, true};
    cursor.expect_word("steps");
    return when;
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

/// The same, or , mean over time, , sum over 4 steps.
When parse_when_counted(Cursor& cursor) {
  if (!cursor.accept(TokenKind::comma)) return parse_when(cursor);
  const bool is_known = cursor.at_word("mean") || cursor.at_word("sum") || cursor.at_word("integral");
  if (!is_known) cursor.fail_expected("mean, sum or integral", "as in: minimise (integral(u) - 1)^2, mean over time");
  Identifier counted = cursor.expect_name("mean, sum or integral");
  cursor.expect_word("over");
  return parse_over(cursor, std::move(counted));
}

ItemKind parse_data(Cursor& cursor) {
  DataItem item;
  item.name = cursor.expect_element("a name for the data");
  item.on = parse_placement(cursor);
  cursor.expect(TokenKind::assign);
  item.value = parse_expression(cursor);
  if (cursor.accept_word("from")) {
    cursor.expect_word("scene");
    item.scene = cursor.expect_name("the name of a scene");
  }
  item.unit = parse_unit(cursor);
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
  constexpr const char* one_a_line = "each unknown stands on a line of its own: unknown a; unknown b";
  item.name = item.initial ? parse_field_or_rate(cursor, what) : cursor.expect_element(what);
  if (cursor.at(TokenKind::comma)) {
    cursor.fail_expected("the end of the line", one_a_line);
    return item;
  }
  if (cursor.accept_word("from")) item.from = parse_expression(cursor);
  if (cursor.accept_word("in")) {
    item.low = parse_expression(cursor);
    cursor.expect(TokenKind::dot_dot);
    item.high = parse_expression(cursor);
  }
  if (cursor.at(TokenKind::comma)) cursor.fail_expected("the end of the line", one_a_line);
  return item;
}

ItemKind parse_minimise(Cursor& cursor) {
  MinimiseItem item;
  item.loss = parse_expression(cursor);
  item.when = parse_when_counted(cursor);
  return item;
}

ItemKind parse_using(Cursor& cursor) {
  UsingItem item;
  item.optimiser = parse_expression(cursor);
  while (cursor.accept(TokenKind::comma)) {
    Identifier name = cursor.expect_name("an option, as iterations 50");
    item.options.push_back({std::move(name.name), parse_expression(cursor), name.range});
  }
  return item;
}

ItemKind parse_learn(Cursor& cursor) {
  LearnItem item;
  item.network = cursor.expect_name("the name of a network");
  if (!cursor.accept_word("from")) return item;
  if (!cursor.at(TokenKind::text))
    cursor.fail_expected("the name of a file in quotes", "as in: learn corrector from \"weights.safetensors\"");
  item.from = parse_expression(cursor);
  return item;
}

/// omega = curl(u): every entry of a map has a formula
NamedFormula parse_map(Cursor& cursor) {
  NamedFormula formula{cursor.expect_element("the name of a field of that scene"), {}, {}};
  cursor.expect(TokenKind::assign);
  formula.value = parse_expression(cursor);
  return formula;
}

/// on trajectories("test.nc") for 100 steps beside plain, fine on trajectories("fine.nc") where omega = curl(u)
void parse_runs(Cursor& cursor, TestItem& item) {
  item.on = parse_expression(cursor);
  if (!cursor.accept_word("for")) return;
  item.steps = parse_expression(cursor);
  cursor.expect_word("steps");
  if (!cursor.accept_word("beside")) return;
  do {
    const bool goes_on =
        !item.beside.empty() && !item.beside.back().map.empty() && cursor.peek_second().kind == TokenKind::assign;
    if (goes_on) {
      item.beside.back().map.push_back(parse_map(cursor));
      continue;
    }
    TestItem::Baseline& beside =
        item.beside.emplace_back(TestItem::Baseline{cursor.expect_name("the name of a scene"), {}, {}});
    if (cursor.accept_word("on")) beside.on = parse_expression(cursor);
    if (cursor.accept_word("where")) beside.map.push_back(parse_map(cursor));
  } while (cursor.accept(TokenKind::comma));
}

ItemKind parse_test(Cursor& cursor) {
  TestItem item;
  std::tie(item.name, item.value) = parse_definition(cursor, "a name for the number");
  item.when = parse_when_counted(cursor);
  if (cursor.accept_word("on")) parse_runs(cursor, item);
  return item;
}

/// Quantity in which runs are compared with the data.
ItemKind parse_compared(Cursor& cursor, TestItem::Kind kind, const char* example) {
  TestItem item;
  item.kind = kind;
  std::tie(item.name, item.value) = parse_definition(cursor, "a name for the number");
  if (kind == TestItem::Kind::correlation && cursor.accept_word("above")) item.above = parse_expression(cursor);
  if (!cursor.accept_word("on"))
    cursor.fail_expected("'on' and a set of trajectories",
                         fmt::format("as in: {} on trajectories(\"test.nc\") for 100 steps", example));
  if (!cursor.failed()) parse_runs(cursor, item);
  return item;
}

ItemKind parse_statistic(Cursor& cursor) {
  return parse_compared(cursor, TestItem::Kind::statistic, "statistic energy = mean(u^2)");
}
ItemKind parse_spectrum(Cursor& cursor) {
  return parse_compared(cursor, TestItem::Kind::spectrum, "spectrum energy = u");
}
ItemKind parse_correlation(Cursor& cursor) {
  return parse_compared(cursor, TestItem::Kind::correlation, "correlation vorticity = curl(u) above 0.8");
}

ItemKind parse_growth(Cursor& cursor) {
  TestItem item;
  item.kind = TestItem::Kind::growth;
  item.name = cursor.expect_name("a name for the rate");
  if (!cursor.accept_word("on"))
    cursor.fail_expected("'on' and a set of trajectories",
                         "as in: growth rate on trajectories(\"test.nc\") for 100 steps");
  if (!cursor.failed()) parse_runs(cursor, item);
  return item;
}

/// nu in 0.01 .. 0.1 logarithmic, re in 100, 200, or s from 100
ItemKind parse_vary(Cursor& cursor) {
  VaryItem item;
  item.name = cursor.expect_element("the name of a parameter");
  if (cursor.accept_word("from")) {
    item.from = parse_expression(cursor);
    return item;
  }
  cursor.expect_word("in");
  Expr first = parse_expression(cursor);
  if (cursor.accept(TokenKind::dot_dot)) {
    item.low = std::move(first);
    item.high = parse_expression(cursor);
    item.is_log = cursor.accept_word("logarithmic");
    return item;
  }
  item.values.push_back(std::move(first));
  while (cursor.accept(TokenKind::comma)) item.values.push_back(parse_expression(cursor));
  return item;
}

/// u, u.x, omega = curl(u), w on centres = curl(u)
NamedFormula parse_frames_of(Cursor& cursor) {
  constexpr const char* hint = "a formula has a name in the file, as in: frames of omega = curl(u) every 0.1";
  if (!cursor.at(TokenKind::identifier) || cursor.peek_second().kind == TokenKind::left_paren)
    cursor.fail_expected("the name of a field, or a name and its formula", hint);
  NamedFormula formula{cursor.expect_element("the name of a field"), {}, {}};
  const bool is_whole = formula.name.name.find_first_of(".[") == std::string::npos;
  if (is_whole) formula.on = parse_placement(cursor);
  if (formula.on ? cursor.expect(TokenKind::assign) : is_whole && cursor.accept(TokenKind::assign))
    formula.value = parse_expression(cursor);
  if (!cursor.at(TokenKind::comma) && !cursor.at_word("every")) cursor.fail_expected("',' or 'every'", hint);
  return formula;
}

ItemKind parse_frames(Cursor& cursor) {
  std::vector<NamedFormula> of;
  if (cursor.accept_word("of")) {
    do {
      of.push_back(parse_frames_of(cursor));
    } while (cursor.accept(TokenKind::comma));
  }
  cursor.expect_word("every");
  FramesItem item{parse_expression(cursor), {}, {}, std::move(of)};
  if (cursor.accept_word("from")) item.from = parse_expression(cursor);
  if (cursor.accept_word("to")) item.to = parse_expression(cursor);
  return item;
}

template <const char* const& word>
ItemKind parse_option(Cursor& cursor) {
  return OptionItem{{word, {}}, parse_expression(cursor)};
}
ItemKind parse_coarsen(Cursor& cursor) {
  OptionItem item{{"coarsen", {}}, parse_expression(cursor)};
  if (cursor.accept_word("in")) item.in = parse_expression(cursor);
  return item;
}
constexpr const char *runs_word = "runs", *seed_word = "seed", *file_word = "file";

}  // namespace

BlockRule data_set_rule() {
  return {"dataset",
          {{"runs", parse_option<runs_word>},
           {"seed", parse_option<seed_word>},
           {"vary", parse_vary},
           {"frames", parse_frames},
           {"coarsen", parse_coarsen},
           {"file", parse_option<file_word>}},
          {}};
}

BlockRule task_rule() {
  return {"task",
          {{"data", parse_data},
           {"unknown", parse_unknown},
           {"learn", parse_learn},
           {"minimise", parse_minimise},
           {"using", parse_using},
           {"test", parse_test},
           {"statistic", parse_statistic},
           {"spectrum", parse_spectrum},
           {"correlation", parse_correlation},
           {"growth", parse_growth}},
          {}};
}

}  // namespace dpde::ast
