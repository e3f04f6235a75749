// SPDX-License-Identifier: Apache-2.0
// Functions that the parse_*.cpp files share. A function that fails leaves the cursor failed, and its result is
// ignored.
#pragma once

#include <string_view>
#include <utility>
#include <vector>

#include "syntax/ast.h"
#include "syntax/parse/cursor.h"

namespace dpde::ast {

// parse_expression.cpp
Expr parse_expression(Cursor& cursor);
/// The rest of a call, starting at `(`.
Expr parse_call(Cursor& cursor, const Identifier& callee);

/// 5, or rate = 5
Argument parse_argument(Cursor& cursor);

// parse_physics.cpp, parse_task.cpp, parse_kernel.cpp, parse_network.cpp, parse_chart.cpp: items of each kind of block
struct ItemRule {
  std::string_view word;  // first word of the item; already taken when parse is called
  ItemKind (*parse)(Cursor&);
};
/// Items that begin with a user-defined name, such as nu = 0.01.
struct NamedItemRule {
  bool (*begins)(const Cursor&) = nullptr;
  ItemKind (*parse)(Cursor&) = nullptr;
  std::string_view example = "";
};
struct BlockRule {
  std::string_view name;
  std::vector<ItemRule> items;
  NamedItemRule named;
};
BlockRule model_rule();
BlockRule scene_rule();
BlockRule scheme_rule();
BlockRule task_rule();
BlockRule kernel_rule();
BlockRule program_rule();
BlockRule repeat_rule();
BlockRule network_rule();
BlockRule data_set_rule();
BlockRule chart_rule();
/// parse_declaration.cpp: { ... } with items of the rule
void parse_items(Cursor& cursor, BlockLayout& layout, const BlockRule& rule, std::vector<Item>& items);

/// a, b, c
/// A field u or its time derivative dt(u); the name as written.
Identifier parse_field_or_rate(Cursor& cursor, const char* what);
/// on faces, on nodes, on faces.x, or empty.
std::optional<Identifier> parse_placement(Cursor& cursor);
// parse_solved.cpp
ItemKind parse_solved(Cursor& cursor);
ItemKind parse_constraint(Cursor& cursor);
// parse_unit.cpp
/// in m/s, or empty.
UnitText parse_unit(Cursor& cursor);
/// u, v in m/s, h in m on faces
struct Declared {
  std::vector<Identifier> names;
  std::vector<UnitText> units;
  std::optional<Identifier> on;
};
Declared parse_declared(Cursor& cursor, const char* what, bool may_lie_somewhere = true);

std::vector<Identifier> parse_names(Cursor& cursor, const char* what);
/// a, u.x, u.y
std::vector<Identifier> parse_components(Cursor& cursor, const char* what);
/// name = value
std::pair<Identifier, Expr> parse_definition(Cursor& cursor, const char* what);
/// u.x = value
std::pair<Identifier, Expr> parse_component_definition(Cursor& cursor, const char* what);
/// x.low = 0, y periodic, ...; the place is "all" if none is written
std::vector<BoundarySide> parse_sides(Cursor& cursor);
/// 8 { ... } after `repeat`, with the items of `rule`. `shared`: word allowed after the count; "": none.
RepeatItem parse_repeat(Cursor& cursor, const BlockRule& rule, std::string_view shared = "");
/// Maximum nesting depth of blocks.
inline constexpr int max_blocks_inside = 16;
/// (u: vector, nu) -> vector, for a network.
void parse_signature(Cursor& cursor, Network& network);
/// u_bar = expr, after `adjoint`.
AdjointItem parse_adjoint(Cursor& cursor);
/// (u: field halo 1, out v: field)
std::vector<KernelParameter> parse_kernel_parameters(Cursor& cursor);

}  // namespace dpde::ast
