// SPDX-License-Identifier: Apache-2.0
// Parses items of models, scenes and schemes.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "support/side_conditions.h"
#include "syntax/parse/parse_parts.h"
#include "syntax/words.h"

namespace dpde::ast {
namespace {

// ---- model ---------------------------------------------------------------------------------------------------------
ItemKind parse_field(Cursor& cursor) {
  Declared fields = parse_declared(cursor, "the name of a field");
  return FieldItem{std::move(fields.names), false, std::move(fields.on), std::move(fields.units)};
}
ItemKind parse_vector(Cursor& cursor) {
  Declared vectors = parse_declared(cursor, "the name of a vector");
  return FieldItem{std::move(vectors.names), true, std::move(vectors.on), std::move(vectors.units)};
}

ItemKind parse_coefficient(Cursor& cursor) {
  const bool vector = cursor.at_word("vector") && cursor.peek_second().kind == TokenKind::identifier;
  if (vector) cursor.take();
  Declared given = parse_declared(cursor, "the name of a coefficient");
  return CoefficientItem{std::move(given.names), vector, std::move(given.on), false, false, std::move(given.units)};
}

ItemKind parse_mask(Cursor& cursor) {
  std::vector<Identifier> names = parse_names(cursor, "the name of a mask");
  std::vector<UnitText> units(names.size());
  return CoefficientItem{std::move(names), false, {}, false, true, std::move(units)};
}

/// nu = 0.01 in m^2/s, c
ItemKind parse_param(Cursor& cursor) {
  ParamItem item;
  do {
    item.names.push_back(cursor.expect_element("the name of a parameter"));
    std::optional<Expr>& value = item.values.emplace_back();
    if (cursor.accept(TokenKind::assign)) value = parse_expression(cursor);
    item.units.push_back(parse_unit(cursor));
    for (std::size_t i = item.units.size() - 1; i-- > 0 && !item.units[i] && !item.values[i];)
      item.units[i] = item.units.back();
  } while (cursor.accept(TokenKind::comma));
  return item;
}

/// Content of the parentheses after dt.
Identifier parse_rated(Cursor& cursor) {
  const Token open = cursor.peek();
  cursor.expect(TokenKind::left_paren);
  cursor.begin_group(open);
  Identifier field = parse_field_or_rate(cursor, "the name of a field");
  cursor.end_group(TokenKind::right_paren);
  return field;
}

ItemKind parse_equation(Cursor& cursor) {
  EquationItem item;
  item.field = parse_rated(cursor);
  cursor.expect(TokenKind::assign);
  item.rhs = parse_expression(cursor);
  return item;
}

/// Whether a line begins with neither a word of models nor dt: u = ..., dx(u) = ..., du/dt = ..., 0 = div(u).
bool begins_no_equation(const Cursor& cursor) {
  if (cursor.at_word("dt")) return false;
  const TokenKind second = cursor.peek_second().kind;
  if (cursor.at_word("solve") && second == TokenKind::left_paren) return false;
  const bool is_part = second == TokenKind::dot || second == TokenKind::left_bracket || second == TokenKind::slash ||
                       second == TokenKind::left_paren;
  return second == TokenKind::assign || (is_part && cursor.at(TokenKind::identifier));
}

/// Advice for du/dt and d(u)/dt; "" for other text.
std::string hint_of_rate(Cursor& cursor) {
  const std::string_view word = cursor.take().spelling.substr(0, 40);
  const bool is_quotient = cursor.accept(TokenKind::slash);
  if (is_quotient && word.starts_with('d') && cursor.at_word("dt"))
    return fmt::format("write dt({}) = ...", word.substr(1));
  return word == "d" && cursor.at(TokenKind::left_paren) ? "a rate is written dt(u) = ..." : "";
}

/// Advice for an assignment to a name that cannot have a value.
std::string hint_of_value(std::string_view name) {
  const bool is_rate = name.size() > 2 && name.ends_with("_t");
  const std::string_view field = is_rate ? name.substr(0, name.size() - 2) : name;
  return fmt::format("write dt({}) = ... for {}, let {} = ... for a shorthand, or {} = ... inside a mask", field,
                     is_rate ? fmt::format("the rate of {}", field) : "a field", name, name);
}

/// A constraint, a field held inside a mask, or a malformed equation.
ItemKind parse_no_equation(Cursor& cursor) {
  if (cursor.at(TokenKind::number)) return parse_constraint(cursor);
  const Token first = cursor.peek();
  const auto refuse = [&](std::string hint) {
    cursor.fail("not-an-equation", first.range, {describe(first)}, std::move(hint));
    return ItemKind{};
  };
  const TokenKind second = cursor.peek_second().kind;
  if (!cursor.at(TokenKind::identifier)) return refuse("");
  if (second == TokenKind::left_paren || second == TokenKind::slash) return refuse(hint_of_rate(cursor));
  HeldItem item;
  item.field = cursor.expect_element("a field");
  const std::string name = item.field.name.substr(0, 40);
  if (!cursor.accept(TokenKind::assign)) return refuse("");
  item.value = parse_expression(cursor);
  if (!cursor.accept_word("inside")) return refuse(hint_of_value(name));
  item.mask = cursor.expect_name("the name of a mask");
  return item;
}

// ---- scene ---------------------------------------------------------------------------------------------------------
void refuse_option(Cursor& cursor, const char* item, const std::vector<std::string>& understood) {
  if (!cursor.at(TokenKind::identifier)) {
    cursor.fail_expected(fmt::format("one of: {}", fmt::join(understood, ", ")));
    return;
  }
  const std::string near = nearest_name(cursor.peek().spelling.substr(0, 40), understood);
  const std::string list = fmt::format("understood here: {}", fmt::join(understood, ", "));
  cursor.fail("unknown-option", cursor.peek().range, {describe(cursor.peek()), item},
              near.empty() ? list : fmt::format("did you mean {}? {}", near, list));
}

void refuse_repetition(Cursor& cursor, bool repeated) {
  if (repeated) cursor.fail("repeated", cursor.peek().range, {describe(cursor.peek())});
}

/// A number that varies in time, or a field, after the word `field` or `vector`.
ItemKind parse_control(Cursor& cursor) {
  const bool vector = cursor.at_word("vector");
  const bool is_field = (vector || cursor.at_word("field")) && cursor.peek_second().kind == TokenKind::identifier;
  if (is_field) cursor.take();
  Declared controls = parse_declared(cursor, "the name of a control", is_field);
  if (!is_field) return ControlItem{std::move(controls.names), std::move(controls.units)};
  return CoefficientItem{std::move(controls.names), vector, std::move(controls.on), true, false,
                         std::move(controls.units)};
}

ItemKind parse_grid(Cursor& cursor) {
  GridItem item;
  item.axis = cursor.expect_name("an axis: x, y or z");
  cursor.expect(TokenKind::assign);
  item.low = parse_expression(cursor);
  cursor.expect(TokenKind::dot_dot);
  item.high = parse_expression(cursor);
  item.unit = parse_unit(cursor);
  while (cursor.accept(TokenKind::comma)) {
    if (cursor.at_word("cells")) {
      refuse_repetition(cursor, item.cells.has_value());
      cursor.take();
      item.cells = parse_expression(cursor);
    } else if (cursor.at_word("periodic")) {
      refuse_repetition(cursor, item.periodic);
      cursor.take();
      item.periodic = true;
    } else if (cursor.at_word("stretched")) {
      refuse_repetition(cursor, item.stretched.has_value());
      cursor.take();
      item.stretched = parse_expression(cursor);
    } else {
      refuse_option(cursor, "grid", {std::begin(grid_options), std::end(grid_options)});
    }
  }
  return item;
}

ItemKind parse_coordinates(Cursor& cursor) { return CoordinatesItem{parse_expression(cursor)}; }

ItemKind parse_value(Cursor& cursor) {
  auto [name, value] = parse_component_definition(cursor, "a name");
  ValueItem item{std::move(name), std::move(value), {}};
  item.unit = parse_unit(cursor);
  if (cursor.accept_word("every")) item.every = parse_expression(cursor);
  return item;
}

ItemKind parse_row(Cursor& cursor) {
  Identifier key = cursor.expect_name("a key of a scheme");
  std::optional<Identifier> of;
  if (cursor.at(TokenKind::identifier)) of = cursor.expect_element("the name of a field");
  cursor.expect(TokenKind::assign);
  return ValueItem{std::move(key), parse_expression(cursor), {}, std::move(of)};
}

ItemKind parse_initial(Cursor& cursor) {
  InitialItem item;
  item.field = parse_field_or_rate(cursor, "the name of a field");
  cursor.expect(TokenKind::assign);
  item.value = parse_expression(cursor);
  if (cursor.accept_word("at")) {
    cursor.expect_word("t");
    cursor.expect(TokenKind::assign);
    item.at = parse_expression(cursor);
  }
  if (cursor.at_word("projected")) item.projected = cursor.expect_name("projected").range;
  return item;
}

ItemKind parse_exact(Cursor& cursor) {
  Identifier field = parse_field_or_rate(cursor, "the name of a field");
  cursor.expect(TokenKind::assign);
  return ExactItem{std::move(field), parse_expression(cursor)};
}

ItemKind parse_observe(Cursor& cursor) {
  Identifier name = cursor.expect_name("a name for what is observed");
  if (cursor.at(TokenKind::left_bracket)) name.name += cursor.expect_indices();
  cursor.expect(TokenKind::assign);
  Expr value = parse_expression(cursor);
  return ObserveItem{std::move(name), std::move(value), parse_unit(cursor)};
}

/// 1e-3 on u, v
ItemKind parse_accuracy(Cursor& cursor) {
  AccuracyItem item{parse_expression(cursor), {}};
  if (cursor.accept_word("on")) item.fields = parse_components(cursor, "the name of a field");
  return item;
}

ItemKind parse_output(Cursor& cursor) {
  OutputItem item;
  do {
    item.fields.push_back(cursor.expect_element("the name of a field"));
  } while (cursor.accept(TokenKind::comma));
  if (cursor.accept_word("every")) item.every = parse_expression(cursor);
  return item;
}

ItemKind parse_boundary(Cursor& cursor) {
  BoundaryItem item;
  item.field = cursor.expect_element("the name of a field");
  if (cursor.at(TokenKind::assign)) {
    const SourceRange range = cursor.take().range;
    item.sides.push_back({{"all", range}, parse_expression(cursor)});
    item.bare = true;
    return item;
  }
  if (!cursor.accept(TokenKind::colon)) {
    cursor.fail_expected("':' or '='", "as in: boundary u: x.low = 0, x.high = 1");
  }
  item.sides = parse_sides(cursor);
  return item;
}

ItemKind parse_time(Cursor& cursor) {
  TimeItem item;
  using Option = std::pair<std::string_view, std::optional<Expr>*>;
  const std::array<Option, 7> options{{{"step", &item.step},
                                       {"courant", &item.courant},
                                       {"speed", &item.speed},
                                       {"tolerance", &item.tolerance},
                                       {"absolute", &item.absolute},
                                       {"first", &item.first},
                                       {"until", &item.steady}}};
  item.from = parse_expression(cursor);
  cursor.expect(TokenKind::dot_dot);
  item.to = parse_expression(cursor);
  item.unit = parse_unit(cursor);
  while (cursor.accept(TokenKind::comma)) {
    const auto option = std::ranges::find(options, cursor.peek().spelling, &Option::first);
    if (option == options.end()) {
      refuse_option(cursor, "time", {std::begin(time_options), std::end(time_options)});
      continue;
    }
    refuse_repetition(cursor, option->second->has_value());
    cursor.take();
    if (option->second == &item.steady) cursor.expect_word("steady");
    *option->second = parse_expression(cursor);
  }
  return item;
}

ItemKind parse_cells(Cursor& cursor) {
  CellsItem item;
  do {
    item.counts.push_back(parse_expression(cursor));
  } while (cursor.accept(TokenKind::comma));
  return item;
}

ItemKind parse_step(Cursor& cursor) { return StepItem{parse_expression(cursor)}; }

/// : u = a, v += b
void parse_updates(Cursor& cursor, EventItem& item) {
  cursor.expect(TokenKind::colon);
  do {
    EventItem::Update update{cursor.expect_element("the name of a field"), false, {}};
    update.accumulate = cursor.accept(TokenKind::plus_assign);
    if (!update.accumulate && !cursor.accept(TokenKind::assign)) cursor.fail_expected("'=' or '+='");
    update.value = parse_expression(cursor);
    item.updates.push_back(std::move(update));
  } while (cursor.accept(TokenKind::comma));
}

ItemKind parse_after(Cursor& cursor) {
  EventItem item;
  cursor.expect_word("step");
  parse_updates(cursor, item);
  return item;
}

ItemKind parse_every(Cursor& cursor) {
  EventItem item;
  item.every = parse_expression(cursor);
  parse_updates(cursor, item);
  return item;
}

ItemKind parse_at(Cursor& cursor) {
  EventItem item;
  cursor.expect_word("t");
  cursor.expect(TokenKind::assign);
  do {
    item.times.push_back(parse_expression(cursor));
  } while (cursor.accept(TokenKind::comma));
  parse_updates(cursor, item);
  return item;
}

ItemKind parse_subcycle(Cursor& cursor) {
  std::vector<Identifier> fields = parse_components(cursor, "the name of a field");
  cursor.expect_word("in");
  return SubcycleItem{std::move(fields), parse_expression(cursor)};
}

bool begins_value(const Cursor& cursor) {
  const TokenKind second = cursor.peek_second().kind;
  return cursor.at(TokenKind::identifier) &&
         (second == TokenKind::assign || second == TokenKind::dot || second == TokenKind::left_bracket);
}

/// key = value, or key FIELD = value
bool begins_row(const Cursor& cursor) {
  return begins_value(cursor) ||
         (cursor.at(TokenKind::identifier) && cursor.peek_second().kind == TokenKind::identifier);
}

ItemKind parse_let(Cursor& cursor) {
  auto [name, value] = parse_component_definition(cursor, "a name");
  return LetItem{std::move(name), std::move(value), parse_unit(cursor)};
}

Identifier parse_place(Cursor& cursor) {
  Identifier place = cursor.expect_name("a side such as x.low");
  if (!cursor.accept(TokenKind::dot)) return place;
  if (!cursor.at_word("low") && !cursor.at_word("high")) {
    cursor.fail_expected(
        "'low' or 'high'",
        fmt::format("the sides of {0} are {0}.low, where {0} is least, and {0}.high", place.name.substr(0, 40)));
    return place;
  }
  const Token side = cursor.take();
  return {place.name + "." + std::string(side.spelling), {place.range.begin, side.range.end}};
}

}  // namespace

std::vector<BoundarySide> parse_sides(Cursor& cursor) {
  std::vector<BoundarySide> sides;
  do {
    BoundarySide side{{"all", cursor.peek().range}, {}};
    const TokenKind second = cursor.peek_second().kind;
    const bool has_place = second == TokenKind::assign || second == TokenKind::dot || second == TokenKind::identifier;
    if (has_place && !cursor.at(TokenKind::assign)) side.place = parse_place(cursor);
    const bool is_word = cursor.at(TokenKind::identifier) && is_side_word(cursor.peek().spelling);
    if (!is_word && !cursor.accept(TokenKind::assign)) {
      cursor.fail_expected("'=', 'periodic' or 'zero_gradient'");
    }
    side.value = parse_expression(cursor);
    sides.push_back(std::move(side));
  } while (cursor.accept(TokenKind::comma));
  return sides;
}

Identifier parse_field_or_rate(Cursor& cursor, const char* what) {
  if (!cursor.at_word("dt") || cursor.peek_second().kind != TokenKind::left_paren) return cursor.expect_element(what);
  const SourceRange dt = cursor.take().range;
  const Token open = cursor.take();
  cursor.begin_group(open);
  const Identifier field = cursor.expect_element(what);
  const SourceRange close = cursor.peek().range;
  cursor.end_group(TokenKind::right_paren);
  return {"dt(" + field.name + ")", {dt.begin, close.end}};
}

std::optional<Identifier> parse_placement(Cursor& cursor) {
  if (!cursor.accept_word("on")) return std::nullopt;
  return cursor.expect_component("a placement: centres, faces, faces.x or nodes");
}

std::vector<Identifier> parse_names(Cursor& cursor, const char* what) {
  std::vector<Identifier> names;
  do {
    names.push_back(cursor.expect_element(what));
  } while (cursor.accept(TokenKind::comma));
  return names;
}

std::vector<Identifier> parse_components(Cursor& cursor, const char* what) {
  std::vector<Identifier> names;
  do {
    names.push_back(cursor.expect_element(what));
  } while (cursor.accept(TokenKind::comma));
  return names;
}

std::pair<Identifier, Expr> parse_definition(Cursor& cursor, const char* what) {
  Identifier name = cursor.expect_name(what);
  cursor.expect(TokenKind::assign);
  return {std::move(name), parse_expression(cursor)};
}

std::pair<Identifier, Expr> parse_component_definition(Cursor& cursor, const char* what) {
  Identifier name = cursor.expect_element(what);
  cursor.expect(TokenKind::assign);
  return {std::move(name), parse_expression(cursor)};
}

BlockRule model_rule() {
  return {"model",
          {{"field", parse_field},
           {"vector", parse_vector},
           {"coefficient", parse_coefficient},
           {"mask", parse_mask},
           {"param", parse_param},
           {"control", parse_control},
           {"let", parse_let},
           {"dt", parse_equation},
           {"solve", parse_solved}},
          {begins_no_equation, parse_no_equation}};
}

BlockRule scene_rule() {
  return {"scene",
          {{"grid", parse_grid},
           {"cells", parse_cells},
           {"let", parse_let},
           {"coordinates", parse_coordinates},
           {"initial", parse_initial},
           {"exact", parse_exact},
           {"boundary", parse_boundary},
           {"time", parse_time},
           {"step", parse_step},
           {"after", parse_after},
           {"every", parse_every},
           {"at", parse_at},
           {"subcycle", parse_subcycle},
           {"observe", parse_observe},
           {"output", parse_output},
           {"accuracy", parse_accuracy}},
          {begins_value, parse_value, "parameter = value"}};
}

BlockRule scheme_rule() { return {"scheme", {}, {begins_row, parse_row, "key = value"}}; }

}  // namespace dpde::ast
