// SPDX-License-Identifier: Apache-2.0
// Names, operators, vectors, and what is dropped.
#include "model/from_ast/formulas/expressions.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "model/build.h"
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
constexpr int max_nested_order = 12;  // nested differences multiply: lap six times over makes 3^6 reads an axis

/// What expressions of a purpose may be made of, beside numbers, parameters and functions.
struct Rules {
  std::string_view place, hint;
  bool fields = false, coordinates = false, time = false, derivatives = false, reductions = false, unknowns = false;
};

Rules anything(std::string_view place) {
  return {.place = place,
          .fields = true,
          .coordinates = true,
          .time = true,
          .derivatives = true,
          .reductions = true,
          .unknowns = true};
}

Rules rules_of(FormulaContext purpose) {
  switch (purpose) {
    case FormulaContext::equation: return anything("an equation");
    case FormulaContext::event: return anything("an event");
    case FormulaContext::quantity: return anything("a sum over space");
    case FormulaContext::initial:
      return {.place = "an initial state",
              .hint = "an initial state is made of numbers, parameters, coordinates and other initial states",
              .coordinates = true,
              .unknowns = true};
    case FormulaContext::coefficient:
      return {.place = "a coefficient",
              .hint = "a coefficient is made of numbers, parameters, coordinates and other coefficients",
              .coordinates = true,
              .unknowns = true};
    case FormulaContext::control_field:
      return {.place = "a control field",
              .hint = "a control field is made of numbers, parameters, coordinates and t",
              .coordinates = true,
              .time = true};
    case FormulaContext::exact:
      return {.place = "an exact solution",
              .hint = "an exact solution is made of numbers, parameters, coordinates and t",
              .coordinates = true,
              .time = true,
              .unknowns = true};
    case FormulaContext::boundary:
      return {.place = "a boundary value",
              .hint =
                  "a boundary value is made of numbers, parameters, coordinates, t, fields, and coefficients at cell "
                  "centres",
              .coordinates = true,
              .time = true,
              .unknowns = true};
    case FormulaContext::mask:
      return {.place = "a mask",
              .hint = "a mask is a condition of numbers, parameters, controls, coordinates and t",
              .coordinates = true,
              .time = true};
    case FormulaContext::control:
      return {.place = "a control", .hint = "a control is made of numbers, parameters and t", .time = true};
    case FormulaContext::boundary_weight:
      return {.place = "a weight of mixed",
              .hint =
                  "in mixed(a, b, c), a*u + b*du/dn = c, c may vary along the wall; a and b are made of numbers, "
                  "parameters and t",
              .time = true,
              .unknowns = true};
    case FormulaContext::number:
      return {.place = "a number of the scene", .hint = "it is made of numbers and parameters"};
    case FormulaContext::stretch:
      return {.place = "a stretched axis",
              .hint = "its formula is made of numbers, parameters and the coordinate of the axis itself",
              .coordinates = true};
    case FormulaContext::scale:
      return {.place = "a scale factor",
              .hint = "it is made of numbers, parameters given in the scene and coordinates",
              .coordinates = true};
  }
  unreachable("purpose");
}

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

/// The condition that holds where `e` does not: not (a < b and c) is a >= b or not c.
Expr opposite(const Expr& e) {
  const auto& b = std::get<Binary>(e->kind);
  if (is_logical(b.op)) return binary(opposite(b.op), opposite(b.left), opposite(b.right), e->origin);
  return binary(opposite(b.op), b.left, b.right, e->origin);
}

bool is_state(const Elaboration& elaboration, const std::string& name) {
  const Symbol* meaning = elaboration.scope.find(name);
  return meaning != nullptr && meaning->role == Role::state;
}

/// Of u_x, u_xx and u_xy how such derivatives are written; "" of other names.
std::string differentiated_below(const Elaboration& elaboration, const std::string& name) {
  const std::size_t line = name.rfind('_');
  if (line == std::string::npos || line + 1 == name.size() || !is_state(elaboration, name.substr(0, line))) return "";
  std::string written = name.substr(0, line);
  const std::string axes = name.substr(line + 1);
  const std::string known = std::string("xyz").substr(0, elaboration.problem.axes.size());
  if (axes.find_first_not_of(known) != std::string::npos || axes.size() > 4) return "";
  if (elaboration.scope.find(written)->is_vector)
    return axes.size() == 1 ? fmt::format("write {}.{}", written, axes) : "";
  const bool is_one_axis = axes.find_first_not_of(axes[0]) == std::string::npos;
  if (axes.size() > 1 && is_one_axis) return fmt::format("write d({}, {}, {})", written, axes[0], axes.size());
  for (const char axis : axes) written = fmt::format("d{}({})", axis, written);
  return fmt::format("write {}", written);
}

/// Of du and d2u, as in du/dx, how a derivative of u is written; "" of other names.
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

std::string_view place_of(FormulaContext purpose) { return rules_of(purpose).place; }

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

TypedExpr Expressions::refuse(const std::string& what, SourceRange range, const std::string& name) {
  const Rules rules = rules_of(purpose_);
  if (purpose_ == FormulaContext::boundary_weight && is_sought(name)) {
    elaboration_.sink.report(
        "unknown-in-boundary", range, {name, subject_},
        "in mixed(a, b, c) parameters that are sought may stand everywhere, sought coefficients and "
        "controls in c only");
    return {};
  }
  elaboration_.sink.report("not-allowed-here", range, {what, std::string(rules.place)}, std::string(rules.hint));
  return {};
}

TypedExpr Expressions::any(const ast::Expr& e) {
  const SourceRange range = e.range();
  return match(
      e->kind, [&](const ast::Number& n) { return number_of(model::number(n.value, {range})); },
      [&](const ast::Text&) {
        elaboration_.sink.report("not-a-number", range, {"text"}, "a file is read by load(\"name.npy\")");
        return TypedExpr{};
      },
      [&](const ast::Name& n) { return name(n, range); }, [&](const ast::Unary& u) { return unary(u, range); },
      [&](const ast::Binary&) { return chain(e); }, [&](const ast::Call& c) { return call(c, range); },
      [&](const ast::Tuple& t) { return tuple(t); }, [&](const ast::Offsets& o) { return offsets(o, range); },
      [&](const ast::Component& c) { return component(c, range); }, [](const ast::Error&) { return TypedExpr{}; });
}

std::optional<Expr> Expressions::number(const ast::Expr& e) {
  const TypedExpr value = definition(e);
  if (value.type == TypedExpr::Type::none) return std::nullopt;
  return as_number(value, e.range());
}

TypedExpr Expressions::numeric(const ast::Expr& e) {
  TypedExpr value = any(e);
  if (value.type != TypedExpr::Type::condition) return value;
  as_number(value, e.range());
  return {};
}

TypedExpr Expressions::definition(const ast::Expr& e) {
  const std::size_t begin = elaboration_.problem.dropped.size();
  const Operand whole{e, any(e)};
  note_if_dropped(whole, begin);
  if (is_too_large(whole.value, e.range())) return {};
  return whole.value;
}

bool Expressions::is_too_large(const TypedExpr& value, SourceRange range) {
  const bool large = std::any_of(value.parts.begin(), value.parts.end(),
                                 [](const Expr& part) { return is_larger_than(part, max_nodes, max_height); });
  if (large) {
    elaboration_.sink.report("too-large", range, {}, "split it into several fields or scenes");
    return true;
  }
  int order = 0;
  for (const Expr& part : value.parts) order = std::max(order, nested_order(part));
  if (order > max_nested_order) elaboration_.sink.report("derivatives-too-deep", range, {std::to_string(order)});
  return order > max_nested_order;
}

std::optional<Expr> Expressions::condition(const ast::Expr& e) {
  const TypedExpr value = any(e);
  if (value.type == TypedExpr::Type::none) return std::nullopt;
  if (value.type == TypedExpr::Type::condition) return value.parts.front();
  elaboration_.sink.report("not-a-condition", e.range(), {describe(value)}, "compare it with something, as in u > 0");
  return std::nullopt;
}

std::optional<Expr> Expressions::as_number(const TypedExpr& value, SourceRange range) {
  if (value.type == TypedExpr::Type::number) return value.parts.front();
  // on one axis a vector that came of grad is a number too
  if (value.type != TypedExpr::Type::condition && value.parts.size() == 1) return value.parts.front();
  if (value.type == TypedExpr::Type::none) return std::nullopt;
  elaboration_.sink.report("not-a-number", range, {describe(value)}, std::string(number_hint(value.type)));
  return std::nullopt;
}

TypedExpr Expressions::name(const ast::Name& e, SourceRange range) {
  if (const auto running = running_.find(e.name); running != running_.end()) return running->second;
  if (function_) return name_in_function(e.name, range);
  const Symbol* meaning = elaboration_.scope.find(e.name);
  if (!meaning && !vector_of(e.name).empty()) return component({e.name, range});
  const auto axis = meaning ? elaboration_.axis_names.end() : elaboration_.axis_names.find(e.name);
  if (axis != elaboration_.axis_names.end()) return name({axis_name(axis->second)}, range);
  if (!meaning && e.name == "identity") return identity();
  if (!meaning) {
    const std::vector<std::string> functions = function_names();
    if (std::find(functions.begin(), functions.end(), e.name) != functions.end()) {
      elaboration_.sink.report("function-without-arguments", range, {e.name}, fmt::format("write {}(...)", e.name));
    } else if (!elaboration_.scope.is_refused(e.name)) {
      elaboration_.sink.report("unknown-name", range, {e.name}, [&] {
        const std::string differentiated = differentiated_by(elaboration_, e.name);
        return differentiated.empty() ? did_you_mean(e.name, elaboration_.scope.names()) : differentiated;
      });
    }
    return {};
  }
  const Rules rules = rules_of(purpose_);
  switch (meaning->role) {
    case Role::state:
    case Role::coefficient:
    case Role::datum:
      if (purpose_ == FormulaContext::initial || purpose_ == FormulaContext::coefficient)
        return given(e.name, *meaning, range);
      if (!rules.fields && !is_known_at_walls(*meaning, e.name))
        return refuse(fmt::format("{} {}", word_for(meaning->role), e.name), range, e.name);
      if (meaning->is_vector) return vector(e.name, range);
      elaboration_.used.insert(e.name);
      if (const auto mask = elaboration_.moving_masks.find(e.name); mask != elaboration_.moving_masks.end())
        return number_of(mask->second);
      return number_of(field(e.name, {range}));
    case Role::parameter: return parameter(e.name, range);
    case Role::let: {
      if (elaboration_.scene_lets.contains(e.name)) return scene_let(e.name, range);
      if (!rules.derivatives) return refuse("let " + e.name, range);
      const auto found = elaboration_.lets.find(e.name);
      return found == elaboration_.lets.end() ? TypedExpr{} : found->second;
    }
    case Role::coordinate:
      if (!rules.coordinates) return refuse("coordinate " + e.name, range);
      if (!has_axis(meaning->axis, range)) return {};
      return number_of(coordinate(meaning->axis, {range}));
    case Role::time:
      if (!rules.time) return refuse("the time t", range);
      return number_of(param("t", {range}));
    case Role::constant: return number_of(model::number(3.141592653589793, {range}));
  }
  unreachable("role");
}

bool Expressions::is_sought(const std::string& name) const {
  if (!elaboration_.task) return false;
  const auto unknowns = items_of<ast::UnknownItem>(elaboration_.task->items);
  return std::any_of(unknowns.begin(), unknowns.end(),
                     [&](const auto& item) { return !item.kind.initial && item.kind.name.name == name; });
}

/// At a wall a coefficient has the value of the cell that touches it; fields of models go on to it as straight lines.
bool Expressions::is_known_at_walls(const Symbol& meaning, const std::string& name) const {
  if (purpose_ != FormulaContext::boundary || meaning.role == Role::datum) return false;
  if (meaning.role == Role::state) return elaboration_.program == nullptr;
  const std::vector<std::string> names = components_of(elaboration_, name);
  return std::all_of(names.begin(), names.end(), [&](const std::string& component) {
    const Coefficient* coefficient = elaboration_.problem.find_coefficient(component);
    return coefficient != nullptr && coefficient->placement == Placement{};
  });
}

TypedExpr Expressions::parameter(const std::string& name, SourceRange range) {
  elaboration_.used.insert(name);
  if (elaboration_.unknowns.contains(name) && !rules_of(purpose_).unknowns) {
    if (purpose_ == FormulaContext::mask) {
      elaboration_.sink.report("unknown-in-mask", range, {name, subject_},
                               "write a smooth mask as a coefficient, as 0.5*(1 - tanh((|x - " + name +
                                   "| - r)/w)), and a force -(u - v)*mask/tau in the equation");
      return {};
    }
    const bool is_value = purpose_ == FormulaContext::control || purpose_ == FormulaContext::control_field ||
                          subject_.starts_with("the value of ");
    elaboration_.sink.report(
        "unknown-in-number", range, {name, subject_},
        is_value ? "write the formula in the model with let, so that it can be differentiated"
                 : "it must be known before the run: write a number, or a parameter that is not sought");
    return {};
  }
  if (elaboration_.controls.contains(name)) {
    const bool may_vary = rules_of(purpose_).time || purpose_ == FormulaContext::quantity;
    const bool is_allowed = may_vary && purpose_ != FormulaContext::control &&
                            purpose_ != FormulaContext::control_field && purpose_ != FormulaContext::boundary_weight;
    return is_allowed ? number_of(param(name, {range})) : refuse("control " + name, range, name);
  }
  const bool is_number =
      purpose_ == FormulaContext::number || purpose_ == FormulaContext::stretch || purpose_ == FormulaContext::scale;
  const auto value = elaboration_.values.find(name);
  if (value == elaboration_.values.end()) {
    if (!is_number) return number_of(param(name, {range}));  // reported at the end
    elaboration_.sink.report(
        "used-before-value", range, {name},
        fmt::format("write {0} = 1 in the scene, or param {0} = 1 in the model; no value is made of itself", name));
    return {};
  }
  if (!value->second) return is_number ? TypedExpr{} : number_of(param(name, {range}));
  const bool folds = is_of_step() && !elaboration_.selection.keeps_params && !elaboration_.unknowns.contains(name);
  if (folds && (*value->second == 0 || *value->second == 1)) return number_of(model::number(*value->second, {range}));
  return number_of(param(name, {range}));
}

TypedExpr Expressions::unary(const ast::Unary& e, SourceRange range) {
  if (e.op == ast::UnaryOp::logical_not) {
    const auto operand = condition(e.operand);
    return operand ? condition_of(opposite(*operand)) : TypedExpr{};
  }
  if (e.op == ast::UnaryOp::magnitude) return magnitude(e.operand, range);
  TypedExpr value = numeric(e.operand);
  for (Expr& part : value.parts) part = negate(part, {range});
  return value;
}

/// A chain such as a + b + c + ... leans to the left and may be long: its spine is walked, not descended.
TypedExpr Expressions::chain(const ast::Expr& e) {
  std::vector<const ast::Expr*> spine;
  const ast::Expr* leftmost = &e;
  for (const ast::Binary* b = nullptr; (b = std::get_if<ast::Binary>(&(*leftmost)->kind)) != nullptr;) {
    spine.push_back(leftmost);
    leftmost = &b->left;
  }
  const std::size_t begin = elaboration_.problem.dropped.size();
  const ast::Expr* left = leftmost;
  TypedExpr value = any(*leftmost);
  for (auto node = spine.rbegin(); node != spine.rend(); ++node) {
    const auto& b = std::get<ast::Binary>((**node)->kind);
    if (is_sum(b.op)) note_if_dropped({*left, value}, begin);
    const std::size_t begin_right = elaboration_.problem.dropped.size();
    const Operand right{b.right, any(b.right)};
    if (is_sum(b.op)) note_if_dropped(right, begin_right);
    value = combine(b.op, {*left, value}, right, (**node).range());
    left = *node;
  }
  return value;
}

TypedExpr Expressions::combine(BinaryOp op, const Operand& left, const Operand& right, SourceRange range) {
  if (left.value.type == TypedExpr::Type::none || right.value.type == TypedExpr::Type::none) return {};
  if (!is_logical(op) && !is_comparison(op)) return arithmetic(op, left, right, range);
  if (is_comparison(op)) {
    const auto a = as_number(left.value, left.source.range()), b = as_number(right.value, right.source.range());
    return a && b ? condition_of(binary(op, *a, *b, {range})) : TypedExpr{};
  }
  for (const Operand* side : {&left, &right}) {
    if (side->value.type == TypedExpr::Type::condition) continue;
    elaboration_.sink.report("not-a-condition", side->source.range(), {describe(side->value)},
                             "compare it with something, as in u > 0");
    return {};
  }
  return condition_of(binary(op, left.value.parts.front(), right.value.parts.front(), {range}));
}

bool Expressions::has_axis(int axis, SourceRange range) {
  if (!elaboration_.problem.has_grid) {
    report_no_grid(elaboration_, "axis " + axis_name(axis), range);
    return false;
  }
  if (axis < axis_count()) return true;
  std::vector<std::string> axes;
  for (const Axis& known : elaboration_.problem.axes) axes.push_back(known.name);
  elaboration_.sink.report("missing-axis", range, {axis_name(axis)},
                           fmt::format("axes of the scene: {}; a grid line adds one", fmt::join(axes, ", ")));
  return false;
}

void Expressions::note_if_dropped(const Operand& term, std::size_t begin) {
  std::vector<std::string>& dropped = elaboration_.problem.dropped;
  const auto is_zero = [](const Expr& part) { return is_constant(part, 0); };
  const std::vector<Expr>& parts = term.value.parts;
  if (!is_of_step() || parts.empty() || !std::all_of(parts.begin(), parts.end(), is_zero)) return;
  if (is_written_sum(term.source) || is_written_zero(term.source)) return;
  dropped.resize(begin);
  dropped.push_back(fmt::format("{} in {}: {}", ast::print(term.source), subject_, reason_for_zero(term.source)));
}

std::string Expressions::reason_for_zero(const ast::Expr& e) {
  std::set<std::string> zeros, ones;
  ast::for_each_name(e, [&](const std::string& name) {
    const auto found = elaboration_.values.find(name);
    if (found == elaboration_.values.end() || !found->second || elaboration_.unknowns.contains(name)) return;
    if (*found->second == 0) zeros.insert(name + " is 0");
    if (*found->second == 1) ones.insert(name + " is 1");
  });
  if (zeros.empty() && ones.empty()) return "it is 0";
  return fmt::format("{}", fmt::join(zeros.empty() ? ones : zeros, ", "));
}

}  // namespace dpde::model
