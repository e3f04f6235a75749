// SPDX-License-Identifier: Apache-2.0
// Parses networks: the header, and layers as words or as values. The layer types and their arguments are checked later.
#include "syntax/parse/parse_parts.h"

namespace dpde::ast {
namespace {

constexpr std::string_view words_of_other_items[] = {"padding",  "initial", "real", "symmetric", "repeat",
                                                     "residual", "skip",    "let",  "host"};

/// conv 32, 5 with any word instead of conv, or out = v3.
bool begins_layer(const Cursor& cursor) {
  if (!cursor.at(TokenKind::identifier)) return false;
  if (cursor.peek_second().kind == TokenKind::assign) return true;
  for (const std::string_view word : words_of_other_items) {
    if (cursor.at_word(word)) return false;
  }
  return true;
}

ItemKind parse_layer(Cursor& cursor) {
  LayerItem item{cursor.expect_name("a layer"), {}, false};
  if (cursor.accept(TokenKind::assign)) return AssignItem{item.layer, false, parse_expression(cursor)};
  if (cursor.at_end_of_item()) return item;
  const Token open = cursor.peek();
  item.parentheses = cursor.at(TokenKind::left_paren);
  if (item.parentheses) {
    cursor.take();
    cursor.begin_group(open);
  }
  do {
    item.arguments.push_back(parse_argument(cursor));
  } while (cursor.accept(TokenKind::comma));
  if (item.parentheses) cursor.end_group(TokenKind::right_paren);
  return item;
}

template <BranchItem::Join join>
ItemKind parse_branch(Cursor& cursor) {
  BranchItem item;
  item.join = join;
  item.word_range = cursor.range_since(cursor.position() - 1);
  if (!cursor.begin_block(max_blocks_inside)) {
    cursor.fail("repeats-too-deep", item.word_range, {std::to_string(max_blocks_inside)});
  }
  BlockRule rule = network_rule();
  rule.name = join == BranchItem::Join::add ? "residual" : "skip";
  parse_items(cursor, item.layout, rule, item.items);
  cursor.end_block();
  return item;
}

ItemKind parse_repeated_layers(Cursor& cursor) {
  BlockRule rule = network_rule();
  rule.name = "repeat";
  return parse_repeat(cursor, rule, "shared");
}

ItemKind parse_layer_value(Cursor& cursor) {
  auto [name, value] = parse_definition(cursor, "a name");
  return LetItem{std::move(name), std::move(value)};
}

/// replicate, or x periodic, y zero
ItemKind parse_padding(Cursor& cursor) {
  constexpr const char* what = "periodic, zero, replicate or reflect";
  PaddingItem item;
  do {
    PaddingItem::Axis axis;
    if (cursor.peek_second().kind == TokenKind::identifier) axis.name = cursor.expect_name("an axis: x, y or z");
    axis.padding = cursor.expect_name(what);
    item.axes.push_back(std::move(axis));
  } while (cursor.accept(TokenKind::comma));
  return item;
}

/// he, seed 7, or only one of them
ItemKind parse_start(Cursor& cursor) {
  StartItem item;
  if (!cursor.at_word("seed")) {
    item.method = cursor.expect_name("he, xavier, zero or seed");
    if (!cursor.accept(TokenKind::comma)) return item;
  }
  cursor.expect_word("seed");
  item.seed = parse_expression(cursor);
  return item;
}

/// flip x, flips, rotations, rotations about z, galilean, galilean(u)
SymmetryItem::Part parse_symmetry(Cursor& cursor) {
  constexpr const char* axis = "an axis: x, y or z";
  SymmetryItem::Part part{cursor.expect_name("flips, flip x, rotations or galilean"), {}, {}};
  if (part.word.name == "flip") part.axis = cursor.expect_name(axis);
  if (part.word.name == "rotations" && cursor.accept_word("about")) part.axis = cursor.expect_name(axis);
  const Token open = cursor.peek();
  if (part.word.name != "galilean" || !cursor.accept(TokenKind::left_paren)) return part;
  cursor.begin_group(open);
  part.inputs = parse_names(cursor, "names of inputs");
  cursor.end_group(TokenKind::right_paren);
  return part;
}

ItemKind parse_symmetries(Cursor& cursor) {
  SymmetryItem item;
  do {
    item.parts.push_back(parse_symmetry(cursor));
  } while (cursor.accept(TokenKind::comma));
  return item;
}

ItemKind parse_real(Cursor& cursor) { return RealItem{cursor.expect_name("f64 or f32")}; }

ItemKind parse_host(Cursor& cursor) {
  cursor.expect_word("weights");
  return HostItem{parse_expression(cursor)};
}

/// u: vector
Network::Input parse_input(Cursor& cursor) {
  Network::Input input{cursor.expect_name("the name of an input")};
  if (!cursor.accept(TokenKind::colon)) return input;
  input.vector = cursor.accept_word("vector");
  if (!input.vector && !cursor.accept_word("scalar")) cursor.fail_expected("'vector' or 'scalar'");
  return input;
}

}  // namespace

void parse_signature(Cursor& cursor, Network& network) {
  const Token open = cursor.peek();
  if (!cursor.expect(TokenKind::left_paren)) return;
  cursor.begin_group(open);
  if (cursor.at(TokenKind::number)) {
    network.input_channels = cursor.expect_whole_number();
  } else {
    do {
      network.inputs.push_back(parse_input(cursor));
    } while (cursor.accept(TokenKind::comma));
  }
  cursor.end_group(TokenKind::right_paren);
  if (!cursor.accept(TokenKind::arrow)) return;
  if (cursor.at(TokenKind::number)) {
    network.output_channels = cursor.expect_whole_number();
  } else {
    network.outputs = parse_names(cursor, "scalar, vector, or names of outputs");
  }
}

BlockRule network_rule() {
  return {"network",
          {{"padding", parse_padding},
           {"initial", parse_start},
           {"symmetric", parse_symmetries},
           {"real", parse_real},
           {"host", parse_host},
           {"repeat", parse_repeated_layers},
           {"residual", parse_branch<BranchItem::Join::add>},
           {"skip", parse_branch<BranchItem::Join::concat>},
           {"let", parse_layer_value}},
          {begins_layer, parse_layer, "a layer such as conv 32, 5"}};
}

}  // namespace dpde::ast
