// SPDX-License-Identifier: Apache-2.0
// Names, operators, vectors, and dropped terms.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "model/build.h"
#include "model/from_ast/formulas/built_ins.h"
#include "model/from_ast/formulas/elaborate.h"
#include "model/from_ast/parts.h"
#include "support/assert.h"
#include "support/match.h"
#include "support/maths/comparisons.h"
#include "syntax/expand/calls.h"
#include "syntax/print/print_ast.h"

namespace dpde::model {

namespace {

constexpr int max_nodes = 20000;
constexpr int max_height = 1000;
constexpr int max_nested_order = 12;  // widths of nested differences multiply: six nested lap read 3^6 points per axis

/// Allowed contents of formulas in a context, in addition to numbers, parameters and functions.
struct Rules {
  FormulaContext context;
  std::string_view place;
  bool coordinates, time, unknowns, fields;  // fields: also lets of the model
  std::string_view hint = "";
};

constexpr bool yes = true, no = false;
constexpr Rules rules[] = {
    {FormulaContext::equation, "an equation", yes, yes, yes, yes},
    {FormulaContext::event, "an event", yes, yes, yes, yes},
    {FormulaContext::initial, "an initial state", yes, no, yes, no,
     "an initial state is made of numbers, parameters, coordinates and other initial states"},
    {FormulaContext::coefficient, "a coefficient", yes, no, yes, no,
     "a coefficient is made of numbers, parameters, coordinates and other coefficients"},
    {FormulaContext::control_field, "a control field", yes, yes, no, no,
     "a control field is made of numbers, parameters, coordinates and t"},
    {FormulaContext::mask, "a mask", yes, yes, no, no,
     "a mask is a condition of numbers, parameters, controls, coordinates and t"},
    {FormulaContext::exact, "an exact solution", yes, yes, yes, no,
     "an exact solution is made of numbers, parameters, coordinates and t"},
    {FormulaContext::boundary, "a boundary value", yes, yes, yes, no,
     "a boundary value is made of numbers, parameters, coordinates, t, fields, and coefficients at cell centres"},
    {FormulaContext::boundary_weight, "a weight of mixed", no, yes, yes, no,
     "in mixed(a, b, c), a*u + b*du/dn = c, c may vary along the wall; a and b are made of numbers, parameters and t"},
    {FormulaContext::control, "a control", no, yes, no, no, "a control is made of numbers, parameters and t"},
    {FormulaContext::number, "a number of the scene", no, no, no, no, "it is made of numbers and parameters"},
    {FormulaContext::stretch, "a stretched axis", yes, no, no, no,
     "its formula is made of numbers, parameters and the coordinate of the axis itself"},
    {FormulaContext::scale, "a scale factor", yes, no, no, no,
     "it is made of numbers, parameters given in the scene and coordinates"},
    {FormulaContext::quantity, "a sum over space", yes, yes, yes, yes},
};

constexpr bool has_a_row_each() {
  for (std::size_t i = 0; i < std::size(rules); ++i) {
    if (rules[i].context != static_cast<FormulaContext>(i)) return false;
  }
  return std::size(rules) == static_cast<std::size_t>(FormulaContext::quantity) + 1;
}
static_assert(has_a_row_each(), "a row for each context, in their order");

const Rules& rules_of(FormulaContext context) { return rules[static_cast<std::size_t>(context)]; }

TypedExpr condition_of(Expr e) { return {TypedExpr::Type::condition, {std::move(e)}}; }

bool is_sum(BinaryOp op) { return op == BinaryOp::add || op == BinaryOp::subtract; }

BinaryOp opposite(BinaryOp op) {
  switch (op) {
    case BinaryOp::less: return BinaryOp::greater_equal;
    case BinaryOp::less_equal: return BinaryOp::greater;
    case BinaryOp::greater: return BinaryOp::less_equal;
    case BinaryOp::greater_equal: return BinaryOp::less;
    case BinaryOp::equal: return BinaryOp::not_equal;
    case BinaryOp::not_equal: return BinaryOp::equal;
    case BinaryOp::logical_and: return BinaryOp::logical_or;
    case BinaryOp::logical_or: return BinaryOp::logical_and;
    case BinaryOp::add:
    case BinaryOp::subtract:
    case BinaryOp::multiply:
    case BinaryOp::divide:
    case BinaryOp::power: break;
  }
  unreachable("the opposite of an operation on numbers");
}

/// The negation of a condition: not (a < b and c) becomes a >= b or not c.
Expr opposite(const Expr& e) {
  const auto& b = std::get<Binary>(e->kind);
  if (is_logical(b.op)) return binary(opposite(b.op), opposite(b.left), opposite(b.right), e->origin);
  return binary(opposite(b.op), b.left, b.right, e->origin);
}

bool is_state(const Elaboration& elaboration, const std::string& name) {
  const Symbol* meaning = elaboration.names.scope.find(name);
  return meaning != nullptr && meaning->role == Role::state;
}

/// The derivative in the syntax of the language for names u_x, u_xx and u_xy; "" for other names.
std::string differentiated_below(const Elaboration& elaboration, const std::string& name) {
  const std::size_t line = name.rfind('_');
  if (line == std::string::npos || line + 1 == name.size() || !is_state(elaboration, name.substr(0, line))) return "";
  std::string written = name.substr(0, line);
  const std::string axes = name.substr(line + 1);
  const std::string known = std::string("xyz").substr(0, elaboration.problem.axes.size());
  if (axes.find_first_not_of(known) != std::string::npos || axes.size() > 4) return "";
  if (elaboration.names.scope.find(written)->is_vector)
    return axes.size() == 1 ? fmt::format("write {}.{}", written, axes) : "";
  const bool is_one_axis = axes.find_first_not_of(axes[0]) == std::string::npos;
  if (axes.size() > 1 && is_one_axis) return fmt::format("write d({}, {}, {})", written, axes[0], axes.size());
  for (const char axis : axes) written = fmt::format("d{}({})", axis, written);
  return fmt::format("write {}", written);
}

/// The derivative of u in the syntax of the language for names du and d2u, as in du/dx; "" for other names.
std::string differentiated_by(const Elaboration& elaboration, const std::string& name) {
  if (std::string below = differentiated_below(elaboration, name); !below.empty()) return below;
  if (name.size() < 2 || name[0] != 'd') return "";
  const bool has_order = name.size() > 2 && name[1] >= '1' && name[1] <= '9';
  const std::string field = name.substr(has_order ? 2 : 1);
  if (!is_state(elaboration, field)) return "";
  return has_order ? fmt::format("write d({}, x, {}), or lap({}) for the sum over all axes", field, name[1], field)
                   : fmt::format("write dx({0}), or on the left side dt({0}) = ...", field);
}

std::string_view number_hint(TypedExpr::Type type) {
  if (type == TypedExpr::Type::condition) return "write if(condition, 1, 0)";
  return type == TypedExpr::Type::tensor
             ? "a component as (S).xy is a number; trace(S) and inner(S, T) make one of tensors"
             : "a component as (v).x is a number; dot(a, b) and div(v) make one of vectors";
}

bool is_written_sum(const ast::Expr& e) {
  const auto* b = std::get_if<ast::Binary>(&e->kind);
  return b && is_sum(b->op);
}

bool is_written_zero(const ast::Expr& e) {
  const auto* number = std::get_if<ast::Number>(&e->kind);
  return number && number->value == 0;
}

}  // namespace

std::string_view place_of(FormulaContext context) { return rules_of(context).place; }

std::string describe(const TypedExpr& value) {
  switch (value.type) {
    case TypedExpr::Type::none: return "mistake";
    case TypedExpr::Type::number: return "number";
    case TypedExpr::Type::vector: return "vector of " + counted(static_cast<int>(value.parts.size()), "component");
    case TypedExpr::Type::tensor: return "tensor of " + counted(static_cast<int>(value.parts.size()), "component");
    case TypedExpr::Type::condition: return "condition";
  }
  unreachable("type");
}

namespace formulas {

namespace {

TypedExpr combine(FormulaScope& here, BinaryOp op, const Operand& left, const Operand& right, SourceRange range);
void note_if_dropped(FormulaScope& here, const Operand& term, std::size_t begin);
std::string reason_for_zero(FormulaScope& here, const ast::Expr& e);

bool is_sought(FormulaScope& here, const std::string& name) {
  if (!here.elaboration.blocks.task) return false;
  const auto unknowns = items_of<ast::UnknownItem>(here.elaboration.blocks.task->items);
  return std::any_of(unknowns.begin(), unknowns.end(),
                     [&](const auto& item) { return !item.kind.initial && item.kind.name.name == name; });
}

/// At a wall a coefficient has the value of the adjacent cell; fields of models are extrapolated linearly to it.
bool is_known_at_walls(FormulaScope& here, const Symbol& meaning, const std::string& name) {
  if (here.context != FormulaContext::boundary || meaning.role == Role::datum) return false;
  if (meaning.role == Role::state) return here.elaboration.blocks.program == nullptr;
  const std::vector<std::string> names = components_of(here.elaboration, name);
  return std::all_of(names.begin(), names.end(), [&](const std::string& component) {
    const Coefficient* coefficient = here.elaboration.problem.find_coefficient(component);
    return coefficient != nullptr && coefficient->placement == Placement{};
  });
}

TypedExpr parameter(FormulaScope& here, const std::string& name, SourceRange range) {
  here.elaboration.params.used.insert(name);
  if (here.elaboration.params.unknowns.contains(name) && !rules_of(here.context).unknowns) {
    if (here.context == FormulaContext::mask) {
      here.elaboration.sink.report("unknown-in-mask", range, {name, here.subject},
                                   "write a smooth mask as a coefficient, as 0.5*(1 - tanh((|x - " + name +
                                       "| - r)/w)), and a force -(u - v)*mask/tau in the equation");
      return {};
    }
    const bool is_value = here.context == FormulaContext::control || here.context == FormulaContext::control_field ||
                          here.subject.starts_with("the value of ");
    here.elaboration.sink.report(
        "unknown-in-number", range, {name, here.subject},
        is_value ? "write the formula in the model with let, so that it can be differentiated"
                 : "it must be known before the run: write a number, or a parameter that is not an unknown");
    return {};
  }
  if (here.elaboration.params.controls.contains(name)) {
    const bool may_vary = rules_of(here.context).time || here.context == FormulaContext::quantity;
    const bool is_allowed = may_vary && here.context != FormulaContext::control &&
                            here.context != FormulaContext::control_field &&
                            here.context != FormulaContext::boundary_weight;
    return is_allowed ? number_of(param(name, {range})) : refuse(here, "control " + name, range, name);
  }
  const bool is_number = here.context == FormulaContext::number || here.context == FormulaContext::stretch ||
                         here.context == FormulaContext::scale;
  const auto value = here.elaboration.params.values.find(name);
  if (value == here.elaboration.params.values.end()) {
    if (!is_number) return number_of(param(name, {range}));  // reported at the end
    here.elaboration.sink.report(
        "used-before-value", range, {name},
        fmt::format("write {0} = 1 in the scene, or param {0} = 1 in the model; no value depends on itself", name));
    return {};
  }
  if (!value->second) return is_number ? TypedExpr{} : number_of(param(name, {range}));
  const bool folds =
      here.is_of_step() && !here.elaboration.selection.keeps_params && !here.elaboration.params.unknowns.contains(name);
  if (folds && (*value->second == 0 || *value->second == 1)) return number_of(model::number(*value->second, {range}));
  return number_of(param(name, {range}));
}

TypedExpr symbol(FormulaScope& here, const Symbol& meaning, const std::string& name, SourceRange range) {
  const Rules& allowed = rules_of(here.context);
  switch (meaning.role) {
    case Role::state:
    case Role::coefficient:
    case Role::datum:
      if (here.context == FormulaContext::initial || here.context == FormulaContext::coefficient)
        return given(here, name, meaning, range);
      if (!allowed.fields && !is_known_at_walls(here, meaning, name))
        return refuse(here, fmt::format("{} {}", word_for(meaning.role), name), range, name);
      if (meaning.is_vector) return vector(here, name, range);
      here.elaboration.params.used.insert(name);
      if (const auto mask = here.elaboration.masks.moving.find(name); mask != here.elaboration.masks.moving.end())
        return number_of(mask->second);
      return number_of(field(name, {range}));
    case Role::parameter: return parameter(here, name, range);
    case Role::let: {
      if (here.elaboration.names.scene_lets.contains(name)) return scene_let(here, name, range);
      if (!allowed.fields) return refuse(here, "let " + name, range);
      const auto found = here.elaboration.names.lets.find(name);
      return found == here.elaboration.names.lets.end() ? TypedExpr{} : found->second;
    }
    case Role::coordinate:
      if (!allowed.coordinates) return refuse(here, "coordinate " + name, range);
      if (!has_axis(here, meaning.axis, range)) return {};
      return number_of(coordinate(meaning.axis, {range}));
    case Role::time:
      if (!allowed.time) return refuse(here, "the time t", range);
      return number_of(param("t", {range}));
    case Role::constant: return number_of(model::number(3.141592653589793, {range}));
  }
  unreachable("role");
}

TypedExpr unary(FormulaScope& here, const ast::Unary& e, SourceRange range) {
  if (e.op == ast::UnaryOp::logical_not) {
    const auto operand = condition(here, e.operand);
    return operand ? condition_of(opposite(*operand)) : TypedExpr{};
  }
  if (e.op == ast::UnaryOp::magnitude) return magnitude(here, e.operand, range);
  TypedExpr value = numeric(here, e.operand);
  for (Expr& part : value.parts) part = negate(part, {range});
  return value;
}

/// A chain a + b + c + ... is nested to the left and may be long, so it is processed in a loop without recursion.
TypedExpr chain(FormulaScope& here, const ast::Expr& e) {
  std::vector<const ast::Expr*> spine;
  const ast::Expr* leftmost = &e;
  for (const ast::Binary* b = nullptr; (b = std::get_if<ast::Binary>(&(*leftmost)->kind)) != nullptr;) {
    spine.push_back(leftmost);
    leftmost = &b->left;
  }
  const std::size_t begin = here.elaboration.problem.remarks.dropped.size();
  const ast::Expr* left = leftmost;
  TypedExpr value = any(here, *leftmost);
  for (auto node = spine.rbegin(); node != spine.rend(); ++node) {
    const auto& b = std::get<ast::Binary>((**node)->kind);
    if (is_sum(b.op)) note_if_dropped(here, {*left, value}, begin);
    const std::size_t begin_right = here.elaboration.problem.remarks.dropped.size();
    const Operand right{b.right, any(here, b.right)};
    if (is_sum(b.op)) note_if_dropped(here, right, begin_right);
    value = combine(here, b.op, {*left, value}, right, (**node).range());
    value.unit = here.elaboration.measures.note(**node, {});
    left = *node;
  }
  return value;
}

TypedExpr combine(FormulaScope& here, BinaryOp op, const Operand& left, const Operand& right, SourceRange range) {
  if (left.value.type == TypedExpr::Type::none || right.value.type == TypedExpr::Type::none) return {};
  if (!is_logical(op) && !is_comparison(op)) return arithmetic(here, op, left, right, range);
  if (is_comparison(op)) {
    const auto a = as_number(here, left.value, left.source.range()),
               b = as_number(here, right.value, right.source.range());
    return a && b ? condition_of(binary(op, *a, *b, {range})) : TypedExpr{};
  }
  for (const Operand* side : {&left, &right}) {
    if (side->value.type == TypedExpr::Type::condition) continue;
    here.elaboration.sink.report("not-a-condition", side->source.range(), {describe(side->value)},
                                 "compare it with something, as in u > 0");
    return {};
  }
  return condition_of(binary(op, left.value.parts.front(), right.value.parts.front(), {range}));
}

void note_if_dropped(FormulaScope& here, const Operand& term, std::size_t begin) {
  std::vector<std::string>& dropped = here.elaboration.problem.remarks.dropped;
  const auto is_zero = [](const Expr& part) { return is_literal(part, 0); };
  const std::vector<Expr>& parts = term.value.parts;
  if (!here.is_of_step() || parts.empty() || !std::all_of(parts.begin(), parts.end(), is_zero)) return;
  if (is_written_sum(term.source) || is_written_zero(term.source)) return;
  dropped.resize(begin);
  dropped.push_back(
      fmt::format("{} in {}: {}", ast::print(term.source), here.subject, reason_for_zero(here, term.source)));
}

std::string reason_for_zero(FormulaScope& here, const ast::Expr& e) {
  std::set<std::string> zeros, ones;
  ast::for_each_name(e, [&](const std::string& name) {
    const auto found = here.elaboration.params.values.find(name);
    if (found == here.elaboration.params.values.end() || !found->second ||
        here.elaboration.params.unknowns.contains(name))
      return;
    if (*found->second == 0) zeros.insert(name + " is 0");
    if (*found->second == 1) ones.insert(name + " is 1");
  });
  if (zeros.empty() && ones.empty()) return "it is 0";
  return fmt::format("{}", fmt::join(zeros.empty() ? ones : zeros, ", "));
}

}  // namespace

TypedExpr refuse(FormulaScope& here, const std::string& what, SourceRange range, const std::string& name) {
  const Rules& allowed = rules_of(here.context);
  if (here.context == FormulaContext::boundary_weight && is_sought(here, name)) {
    here.elaboration.sink.report(
        "unknown-in-boundary", range, {name, here.subject},
        "in mixed(a, b, c) unknown parameters may stand everywhere, unknown coefficients and controls in c only");
    return {};
  }
  here.elaboration.sink.report("not-allowed-here", range, {what, std::string(allowed.place)},
                               std::string(allowed.hint));
  return {};
}

TypedExpr any(FormulaScope& here, const ast::Expr& e) {
  const SourceRange range = e.range();
  TypedExpr value = match(
      e->kind, [&](const ast::Number& n) { return number_of(model::number(n.value, {range})); },
      [&](const ast::Text&) {
        here.elaboration.sink.report("not-a-number", range, {"text"}, "a file is read by load(\"name.npy\")");
        return TypedExpr{};
      },
      [&](const ast::Name& n) { return named(here, n, range); },
      [&](const ast::Unary& u) { return unary(here, u, range); }, [&](const ast::Binary&) { return chain(here, e); },
      [&](const ast::Call& c) { return call(here, c, range); }, [&](const ast::Tuple& t) { return tuple(here, t); },
      [&](const ast::Offsets& o) { return offsets(here, o, range); },
      [&](const ast::Component& c) { return component(here, c, range); },
      [](const ast::Error&) { return TypedExpr{}; });
  const bool is_chain = std::holds_alternative<ast::Binary>(e->kind);
  if (!is_chain) value.unit = here.elaboration.measures.note(e, std::move(value.unit));
  return value;
}

TypedExpr measured(FormulaScope& here, const ast::Expr& e) {
  TypedExpr value = any(here, e);
  value.unit = here.elaboration.measures.of(e);
  return value;
}

TypedExpr part_of(const TypedExpr& whole, int i) {
  return {TypedExpr::Type::number,
          {whole.parts[static_cast<std::size_t>(i)]},
          unit_of_part(whole.unit, whole.type == TypedExpr::Type::vector ? i : -1)};
}

std::optional<Expr> number(FormulaScope& here, const ast::Expr& e) {
  const TypedExpr value = definition(here, e);
  if (value.type == TypedExpr::Type::none) return std::nullopt;
  return as_number(here, value, e.range());
}

TypedExpr numeric(FormulaScope& here, const ast::Expr& e) {
  TypedExpr value = any(here, e);
  if (value.type != TypedExpr::Type::condition) return value;
  as_number(here, value, e.range());
  return {};
}

TypedExpr definition(FormulaScope& here, const ast::Expr& e) {
  const std::size_t begin = here.elaboration.problem.remarks.dropped.size();
  const Operand whole{e, any(here, e)};
  note_if_dropped(here, whole, begin);
  if (is_too_large(here, whole.value, e.range())) return {};
  return whole.value;
}

bool is_too_large(FormulaScope& here, const TypedExpr& value, SourceRange range) {
  const bool large = std::any_of(value.parts.begin(), value.parts.end(),
                                 [](const Expr& part) { return is_larger_than(part, max_nodes, max_height); });
  if (large) {
    here.elaboration.sink.report("too-large", range, {}, "split it into several fields or scenes");
    return true;
  }
  int order = 0;
  for (const Expr& part : value.parts) order = std::max(order, nested_order(part));
  if (order > max_nested_order) here.elaboration.sink.report("derivatives-too-deep", range, {std::to_string(order)});
  return order > max_nested_order;
}

std::optional<Expr> condition(FormulaScope& here, const ast::Expr& e) {
  const TypedExpr value = any(here, e);
  if (value.type == TypedExpr::Type::none) return std::nullopt;
  if (value.type == TypedExpr::Type::condition) return value.parts.front();
  here.elaboration.sink.report("not-a-condition", e.range(), {describe(value)},
                               "compare it with something, as in u > 0");
  return std::nullopt;
}

std::optional<Expr> as_number(FormulaScope& here, const TypedExpr& value, SourceRange range) {
  if (value.type == TypedExpr::Type::number) return value.parts.front();
  // on one axis a vector from grad is also a number
  if (value.type != TypedExpr::Type::condition && value.parts.size() == 1) return value.parts.front();
  if (value.type == TypedExpr::Type::none) return std::nullopt;
  here.elaboration.sink.report("not-a-number", range, {describe(value)}, std::string(number_hint(value.type)));
  return std::nullopt;
}

TypedExpr named(FormulaScope& here, const ast::Name& e, SourceRange range) {
  if (const auto running = here.variables.find(e.name); running != here.variables.end()) return running->second;
  if (here.function) return name_in_function(here, e.name, range);
  const Symbol* meaning = here.elaboration.names.scope.find(e.name);
  if (!meaning && !vector_of(e.name).empty()) return component(here, {e.name, range});
  const auto axis = meaning ? here.elaboration.names.axis_names.end() : here.elaboration.names.axis_names.find(e.name);
  if (axis != here.elaboration.names.axis_names.end()) return named(here, {axis_name(axis->second)}, range);
  if (!meaning && e.name == "identity") return identity(here);
  if (!meaning) {
    const std::vector<std::string> functions = function_names();
    if (std::find(functions.begin(), functions.end(), e.name) != functions.end()) {
      here.elaboration.sink.report("function-without-arguments", range, {e.name}, fmt::format("write {}(...)", e.name));
    } else if (!here.elaboration.names.scope.is_refused(e.name)) {
      here.elaboration.sink.report("unknown-name", range, {e.name}, [&] {
        const std::string differentiated = differentiated_by(here.elaboration, e.name);
        return differentiated.empty() ? did_you_mean(e.name, here.elaboration.names.scope.names()) : differentiated;
      });
    }
    return {};
  }
  TypedExpr value = symbol(here, *meaning, e.name, range);
  const bool has_own_unit = meaning->role == Role::let && !value.unit.empty();
  if (!has_own_unit) value.unit = here.elaboration.measures.of_symbol(*meaning, e.name);
  return value;
}

bool has_axis(FormulaScope& here, int axis, SourceRange range) {
  if (!here.elaboration.problem.has_grid) {
    report_no_grid(here.elaboration, "axis " + axis_name(axis), range);
    return false;
  }
  if (axis < here.axis_count()) return true;
  std::vector<std::string> axes;
  for (const Axis& known : here.elaboration.problem.axes) axes.push_back(known.name);
  here.elaboration.sink.report("missing-axis", range, {axis_name(axis)},
                               fmt::format("axes of the scene: {}; a grid line adds one", fmt::join(axes, ", ")));
  return false;
}

}  // namespace formulas

}  // namespace dpde::model
