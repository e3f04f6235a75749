// SPDX-License-Identifier: Apache-2.0
// Declared placements, and the check that every expression can be evaluated at its placement.
#include <fmt/format.h>

#include <algorithm>

#include "model/analyse/placement.h"
#include "model/build.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"
#include "model/print/print_model.h"
#include "model/print/words.h"
#include "model/uses.h"
#include "support/assert.h"

namespace dpde::model {

namespace {

constexpr int cells_of_cubics = 3;
constexpr const char* placements_hint =
    "write on centres, on nodes, on faces.x, on edges.x, or vector ... on faces, on edges";

int axis_count(const Elaboration& elaboration) { return static_cast<int>(elaboration.problem.axes.size()); }

/// Each reduction has its own placement.
void check_quantity(Elaboration& elaboration, const Placements& placements, const Expr& e, SourceRange where) {
  if (const auto* reduce = as<Reduce>(e)) {
    if (const auto mistake = placements.find_mistake(reduce->operand)) report_misplaced(elaboration, *mistake, where);
    return;
  }
  for_each_child(e, [&](const Expr& part) { check_quantity(elaboration, placements, part, where); });
}

/// The bounded axis along which a field is staggered, or -1.
int walled_axis(const Elaboration& elaboration, const Placement& placement) {
  for (int axis = 0; axis < axis_count(elaboration); ++axis) {
    if (placement[static_cast<std::size_t>(axis)] && elaboration.problem.axes[axis].topology == Topology::bounded)
      return axis;
  }
  return -1;
}

bool holds_advect(const Expr& e) { return holds_any<Advect>(e); }

bool moves(const Expr& e) { return is<Derivative, Interpolate, Advect, Shift>(e); }

/// Whether the body of an operator reads a parameter at other points.
bool takes_elsewhere(const Expr& e, const std::string& parameter, bool inside) {
  const auto* field = as<Field>(e);
  if (field && inside && field->name == parameter) return true;
  return any_child(e, [&](const Expr& part) { return takes_elsewhere(part, parameter, inside || moves(e)); });
}

/// Coefficients and data have no boundary conditions: between walls a staggered one has values on the high wall but not
/// on the low one.
void check_no_wall_values(Elaboration& elaboration, const Placements& placements, const Expr& e, bool inside,
                          SourceRange where) {
  if (const auto* field = as<Field>(e)) {
    const int axis = walled_axis(elaboration, placements.of(field->name));
    if (!inside || axis < 0 || elaboration.problem.find_state(field->name)) return;
    elaboration.sink.report("no-wall-value", e->origin.range.is_known() ? e->origin.range : where,
                            {field->name, elaboration.problem.axes[axis].name},
                            fmt::format("a field has a boundary: make it one, with dt({}) = 0", field->name));
    return;
  }
  if (const auto* sampled = as<Sample>(e)) {
    return check_no_wall_values(elaboration, placements, field(sampled->field, e->origin), true, where);
  }
  if (const auto* network = as<NetworkCall>(e)) {  // its arguments are read at their own placements
    for (const Expr& argument : network->arguments)
      check_no_wall_values(elaboration, placements, argument, false, where);
    return;
  }
  if (const auto* applied = as<Apply>(e)) {
    for (std::size_t i = 0; i < applied->arguments.size(); ++i) {
      const bool elsewhere = std::ranges::any_of(applied->function.body, [&](const Expr& body) {
        return takes_elsewhere(body, applied->function.parameters[i], inside);
      });
      check_no_wall_values(elaboration, placements, applied->arguments[i], inside || elsewhere, where);
    }
    return;
  }
  for_each_child(
      e, [&](const Expr& part) { check_no_wall_values(elaboration, placements, part, inside || moves(e), where); });
}

/// A coefficient that is a field of another model has that field's placement.
void check_coupling(Elaboration& elaboration) {
  if (!elaboration.blocks.scene || elaboration.blocks.scene->also.empty()) return;
  std::vector<ast::Identifier> models{elaboration.blocks.scene->of};
  models.insert(models.end(), elaboration.blocks.scene->also.begin(), elaboration.blocks.scene->also.end());
  for (const ast::Identifier& name : models) {
    const auto* model = find_declaration<ast::Model>(elaboration.file, name.name);
    for (const auto& [item, range] : items_of<ast::CoefficientItem>(model->items)) {
      if (!item.on) continue;
      for (const ast::Identifier& given : item.names) {
        const std::string first = components_of(elaboration, given.name).front();
        const State* state = elaboration.problem.find_state(first);
        const auto placement = placement_named(item.on->name, item.vector ? 0 : -1, axis_count(elaboration));
        if (!state || placement == state->placement) continue;
        elaboration.sink.report("misplaced", item.on->range,
                                {first, describe(state->placement, axis_count(elaboration)),
                                 placement ? describe(*placement, axis_count(elaboration)) : item.on->name},
                                "the coefficient is the field of the other model: leave its placement out");
      }
    }
  }
}

/// "edges" or "faces" if a vector with this word would have the required placement in this component; else "".
std::string places_wanted(const Elaboration& elaboration, const Placements::Mistake& mistake) {
  const auto* field = as<Field>(mistake.part);
  const std::string whole = field ? vector_of(field->name) : "";
  const Symbol* meaning = elaboration.names.scope.find(whole);
  if (!meaning || !meaning->is_vector || meaning->role == Role::datum) return "";
  const int component = axis_of(field->name.substr(whole.size() + 1));
  for (const char* on : {"edges", "faces"}) {
    if (placement_named(on, component, axis_count(elaboration)) == mistake.wanted) return on;
  }
  return "";
}

std::string hint_of(const Elaboration& elaboration, const Placements::Mistake& mistake, const std::string& text) {
  if (elaboration.problem.scheme.derivative_order == spectral)
    return "with dx = spectral all values lie at the cell centres: keep it there, or take differences, as "
           "dx = central(8)";
  const std::string on = places_wanted(elaboration, mistake);
  if (on.empty()) return fmt::format("write interpolate({})", text);
  return fmt::format("write interpolate({}), or declare vector {} on {} where all of it is wanted there", text,
                     vector_of(std::get<Field>(mistake.part->kind).name), on);
}

}  // namespace

void report_misplaced(Elaboration& elaboration, const Placements::Mistake& mistake, SourceRange where) {
  const SourceRange own = mistake.part->origin.range;
  const SourceRange range = own.is_known() ? own : where;
  const std::string text = print(mistake.part);
  if (!mistake.has) {
    elaboration.sink.report("nothing-to-interpolate", range, {},
                            "numbers and formulas of coordinates are known everywhere: leave interpolate out");
    return;
  }
  elaboration.sink.report(
      "misplaced", range,
      {text, describe(*mistake.has, axis_count(elaboration)), describe(mistake.wanted, axis_count(elaboration))},
      hint_of(elaboration, mistake, text));
}

std::optional<Placement> placement_named(const std::string& on, int component, int axes) {
  Placement placement{};
  if (on == "centres") return placement;
  const auto stagger = [&](int axis) { placement[static_cast<std::size_t>(axis)] = true; };
  if (on == "nodes") {
    for (int axis = 0; axis < axes; ++axis) stagger(axis);
    return placement;
  }
  const std::string base = vector_of(on), kind = base.empty() ? on : base;
  const int axis = base.empty() ? component : axis_of(on.substr(base.size() + 1));
  if (kind == "edges" && axis >= 0) {  // on two axes there are also edges along z, each a point
    for (int other = 0; other < axes; ++other) {
      if (other != axis) stagger(other);
    }
    return placement;
  }
  if (kind != "faces" || axis < 0 || axis >= axes) return std::nullopt;
  stagger(axis);
  return placement;
}

Placement placement_of(Elaboration& elaboration, const std::optional<ast::Identifier>& on, int component) {
  if (!on) return {};
  const auto placement = placement_named(on->name, component, axis_count(elaboration));
  if (placement) return *placement;
  if (component > 0) return {};  // reported for the first one
  if (on->name == "faces" || on->name == "edges")
    elaboration.sink.report(
        "unknown-placement", on->range, {on->name + " of a number"},
        on->name == "faces" ? "write on faces.x for those across x" : "write on edges.x for those along x");
  else
    elaboration.sink.report("unknown-placement", on->range, {on->name}, placements_hint);
  return {};
}

namespace {

/// Between walls on which a state lies, cubic interpolation needs four points, including those on the walls.
void check_cubic(Elaboration& elaboration, const State& state) {
  const Transport& transport = elaboration.problem.scheme.transport_of(state.name);
  if (transport.advect != Advection::semi_lagrangian || transport.order != 3 || !holds_advect(*state.rhs)) return;
  for (std::size_t i = 0; i < elaboration.problem.axes.size(); ++i) {
    const Axis& axis = elaboration.problem.axes[i];
    if (!state.placement[i] || axis.topology == Topology::periodic || axis.cells >= cells_of_cubics) continue;
    elaboration.sink.report("transport-of-staggered", state.origin.range, {state.name, axis.name},
                            "take more cells, or semi_lagrangian or maccormack for it in the scheme");
  }
}

/// Placement at which a formula is evaluated: its home, or for sums any placement that fits.
enum class Taken { at_home, in_sums, checked_elsewhere };
Taken taken(UseKind kind) {
  switch (kind) {
    case UseKind::equation:
    case UseKind::correction:
    case UseKind::event:
    case UseKind::courant_rate:
    case UseKind::output: return Taken::at_home;
    case UseKind::observable:
    case UseKind::loss:
    case UseKind::test: return Taken::in_sums;
    case UseKind::held_where:
    case UseKind::held_value: return Taken::checked_elsewhere;  // as part of a correction
    case UseKind::potential:
    case UseKind::constraint: return Taken::checked_elsewhere;  // when the constraint is bound
    case UseKind::test_field: return Taken::checked_elsewhere;  // at its natural placement
    case UseKind::initial:
    case UseKind::coefficient:
    case UseKind::unknown_start:  // of coordinates, and networks of these
    case UseKind::control:
    case UseKind::control_start:
    case UseKind::exact:
    case UseKind::boundary_value:
    case UseKind::boundary_weight:
    case UseKind::stretch_map:
    case UseKind::metric: return Taken::checked_elsewhere;           // everything in them is known everywhere
    case UseKind::stated_operator: return Taken::checked_elsewhere;  // where it is used
  }
  unreachable("kind of use");
}

void check_use(Elaboration& elaboration, const Placements& placements, const Use& use) {
  switch (taken(use.kind)) {
    case Taken::at_home:
      if (const auto mistake = placements.find_mistake(use.formula, use.home))
        report_misplaced(elaboration, *mistake, use.origin.range);
      break;
    case Taken::in_sums: check_quantity(elaboration, placements, use.formula, use.origin.range); break;
    case Taken::checked_elsewhere: return;
  }
  check_no_wall_values(elaboration, placements, use.formula, false, use.origin.range);
}

}  // namespace

void check_placements(Elaboration& elaboration) {
  const Placements placements(elaboration.problem);
  if (elaboration.blocks.model) check_pole_places(elaboration);
  for (const State& state : elaboration.problem.states) {
    if (state.rhs) check_cubic(elaboration, state);
  }
  for_each_formula(elaboration.problem, [&](const Use& use) { check_use(elaboration, placements, use); });
  check_network_places(elaboration);
  check_coupling(elaboration);
}

std::vector<std::string> words_of_placements() {
  std::vector<std::string> words{"centres", "nodes", "faces", "edges"};
  for (const char* on : {"faces.", "edges."}) {
    for (const char axis : {'x', 'y', 'z'}) words.push_back(std::string(on) + axis);
  }
  return words;
}

}  // namespace dpde::model
