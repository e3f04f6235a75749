// SPDX-License-Identifier: Apache-2.0
// The task of a scene: data, unknowns, losses, tests, and the optimiser.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "model/build.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/names/constants.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

constexpr const char* data_hint = "write load(\"name.npy\"), load(\"name.nc\", u), or u from scene NAME at t = 1";

/// A field of another scene.
struct OtherField {
  std::string name;
  Placement placement{};
};

std::vector<OtherField> fields_of(const Elaboration& elaboration, const ast::Scene& scene) {
  std::vector<OtherField> fields;
  if (const auto model = coupled_model(elaboration.file, scene)) {
    const int axes = static_cast<int>(items_of<ast::GridItem>(scene.items).size());
    for (const auto& [item, range] : items_of<ast::FieldItem>(model->items)) {
      const auto placed = [&](int component) {
        return item.on ? placement_named(item.on->name, component, axes).value_or(Placement{}) : Placement{};
      };
      for (const ast::Identifier& name : item.names) {
        if (!item.vector) fields.push_back({name.name, placed(-1)});
        for (int axis = 0; item.vector && axis < axes; ++axis) {
          fields.push_back({name.name + "." + axis_name(axis), placed(axis)});
        }
      }
    }
    for (const auto& [item, range] : items_of<ast::EquationItem>(model->items)) {
      const std::string moved = rated_field(item.field.name);
      const auto found = std::ranges::find(fields, moved, &OtherField::name);
      if (!moved.empty())
        fields.push_back({state_name(item.field.name), found == fields.end() ? Placement{} : found->placement});
    }
  } else if (const auto* program = find_declaration<ast::Program>(elaboration.file, scene.of.name)) {
    for (const auto& [swap, range] : items_of<ast::SwapItem>(program->items)) fields.push_back({swap.state.name});
  }
  return fields;
}

/// The fields of a scene with this name, vectors by component; empty after a diagnostic.
std::vector<OtherField> fields_called(Elaboration& elaboration, const ast::Scene& scene, const std::string& name,
                                      SourceRange range) {
  std::vector<OtherField> found;
  std::vector<std::string> known;
  for (const OtherField& field : fields_of(elaboration, scene)) {
    known.push_back(field.name);
    if (field.name == name || vector_of(field.name) == name) found.push_back(field);
  }
  if (found.empty()) {
    elaboration.sink.report("no-such-field", range, {scene.name.name, name}, did_you_mean(name, known));
    return {};
  }
  const bool is_vector = found.front().name != name;
  if (!is_vector || found.size() == elaboration.problem.axes.size()) return found;
  elaboration.sink.report(
      "wrong-length", range,
      {counted(static_cast<int>(elaboration.problem.axes.size()), "component"), std::to_string(found.size())},
      "the two scenes must have the same axes");
  return {};
}

bool is_observable(const ast::Scene& scene, const std::string& name) {
  const auto lines = items_of<ast::ObserveItem>(scene.items);
  return std::any_of(lines.begin(), lines.end(), [&](const auto& line) { return line.kind.name.name == name; });
}

/// Data from a field or an observable of a scene's run.
std::vector<Datum> data_of_run(Elaboration& elaboration, const ast::DataItem& item) {
  const auto* field = std::get_if<ast::Name>(&item.value->kind);
  const auto* scene = find_declaration<ast::Scene>(elaboration.file, item.scene->name);
  if (!field) {
    elaboration.sink.report("bad-data", item.value.range(), {}, data_hint);
  } else if (!scene) {
    elaboration.sink.report("unknown-block", item.scene->range, {"scene", item.scene->name},
                            did_you_mean(item.scene->name, names_of<ast::Scene>(elaboration.file)));
  }
  std::vector<Datum> data;
  if (!field || !scene) return data;
  if (is_observable(*scene, field->name)) {
    Datum& datum = data.emplace_back();
    datum.scene = scene->name.name;
    datum.field = field->name;
    datum.series = true;
    return data;
  }
  for (const OtherField& other : fields_called(elaboration, *scene, field->name, item.value.range())) {
    Datum& datum = data.emplace_back();
    datum.scene = scene->name.name;
    datum.field = other.name;
    datum.placement = other.placement;
  }
  if (item.on) {
    elaboration.sink.report("not-allowed-here", item.on->range, {"a placement", "data of a scene"},
                            "data are placed as the field that they come from");
  }
  return data;
}

/// Data of a file, or of a file for each component: (load("u.npy"), load("v.npy")).
std::vector<Datum> data_of_files(Elaboration& elaboration, const ast::DataItem& item) {
  const auto* tuple = std::get_if<ast::Tuple>(&item.value->kind);
  std::vector<Datum> data;
  for (const ast::Expr& e : tuple ? tuple->elements : std::vector<ast::Expr>{item.value}) {
    const auto file = file_of(elaboration, e);
    if (!file) {
      elaboration.sink.report("bad-data", e.range(), {}, data_hint);
      return {};
    }
    data.emplace_back().file = file->file;
    data.back().variable = file->variable;
    data.back().placement = placement_of(elaboration, item.on, tuple ? static_cast<int>(data.size()) - 1 : -1);
  }
  if (!tuple || data.size() == elaboration.problem.axes.size()) return data;
  elaboration.sink.report(
      "wrong-length", item.value.range(),
      {counted(static_cast<int>(elaboration.problem.axes.size()), "component"), std::to_string(data.size())});
  return {};
}

/// Whether the datum is a component of the requested vector, also on one axis.
bool is_component(const ast::DataItem& item, const Datum& datum) {
  return datum.field != std::get<ast::Name>(item.value->kind).name;
}

void bind_datum(Elaboration& elaboration, const ast::DataItem& item, SourceRange range) {
  const std::optional<std::vector<Datum>> trajectories =
      item.scene ? std::nullopt : data_of_trajectories(elaboration, item);
  std::vector<Datum> data = trajectories ? *trajectories
                            : item.scene ? data_of_run(elaboration, item)
                                         : data_of_files(elaboration, item);
  const bool is_vector = data.size() > 1 || (!data.empty() && !data[0].field.empty() && is_component(item, data[0]));
  const When when = when_of(elaboration, item.when, item.scene && item.scene->name == elaboration.problem.scene);
  if (!declare(elaboration, item.name, Role::datum, is_vector)) return;
  const std::vector<std::string> names = declare_components(elaboration, item.name.name);
  if (names.size() != std::max<std::size_t>(1, data.size())) {
    elaboration.sink.report("bad-data", item.value.range(), {},
                            fmt::format("{} has {} components here, one for each axis", item.name.name, names.size()));
    return;
  }
  for (std::size_t i = 0; i < data.size(); ++i) {
    data[i].name = names[i];
    data[i].when = when;
    data[i].origin = {range};
    elaboration.problem.task->data.push_back(std::move(data[i]));
  }
}

/// One unknown per component.
void bind_unknown_states(Elaboration& elaboration, const ast::UnknownItem& item, const Unknown& common) {
  const std::vector<State*> states = find_states(elaboration, item.name, "an initial state");
  std::vector<Source> from;
  if (item.from && !states.empty()) from = sources_of(elaboration, *item.from, FormulaContext::initial, item.name.name);
  for (std::size_t i = 0; i < states.size(); ++i) {
    Unknown unknown = common;
    unknown.kind = Unknown::Kind::initial;
    unknown.name = states[i]->name;
    unknown.from = item.from ? from[i] : states[i]->initial;
    const bool has_initial = states[i]->initial.formula || !states[i]->initial.file.empty();
    if (!has_initial) states[i]->initial = unknown.from;
    elaboration.problem.task->unknowns.push_back(std::move(unknown));
  }
}

void bind_unknown_coefficients(Elaboration& elaboration, const ast::UnknownItem& item, const Unknown& common) {
  const std::vector<std::string> names = components_of(elaboration, item.name.name);
  const Coefficient* first = elaboration.problem.find_coefficient(names.front());
  const FormulaContext context =
      first && first->is_control() ? FormulaContext::control_field : FormulaContext::coefficient;
  std::vector<Source> from;
  if (item.from) from = sources_of(elaboration, *item.from, context, item.name.name);
  for (std::size_t i = 0; i < names.size(); ++i) {
    for (Coefficient& coefficient : elaboration.problem.coefficients) {
      if (coefficient.name != names[i]) continue;
      Unknown unknown = common;
      unknown.kind = Unknown::Kind::coefficient;
      unknown.name = coefficient.name;
      unknown.from = item.from ? from[i] : coefficient.value;
      const bool has_value = coefficient.value.formula || !coefficient.value.file.empty();
      if (!has_value) coefficient.value = unknown.from;
      elaboration.problem.task->unknowns.push_back(std::move(unknown));
    }
  }
}

/// `unknown NAME`: a parameter or a coefficient.
void bind_unknown_values(Elaboration& elaboration, const ast::UnknownItem& item, Unknown unknown) {
  const Symbol* meaning = elaboration.names.scope.find(item.name.name);
  if (elaboration.names.scope.is_refused(item.name.name)) return;
  if (!meaning) {
    std::vector<std::string> known = elaboration.names.scope.names(Role::parameter);
    for (const std::string& coefficient : elaboration.names.scope.names(Role::coefficient))
      known.push_back(coefficient);
    elaboration.sink.report("unknown-name", item.name.range, {item.name.name}, did_you_mean(item.name.name, known));
    return;
  }
  if (meaning->role == Role::coefficient) return bind_unknown_coefficients(elaboration, item, unknown);
  if (meaning->role != Role::parameter) {
    elaboration.sink.report("not-an-unknown", item.name.range, {item.name.name, std::string(word_for(meaning->role))},
                            meaning->role == Role::state ? fmt::format("write unknown initial {}", item.name.name)
                                                         : "unknowns are parameters, coefficients and initial states");
    return;
  }
  if (const Control* control = elaboration.problem.find_control(item.name.name)) {
    unknown.kind = Unknown::Kind::control;
    unknown.from.formula = control->start_formula;
    unknown.from.origin = {item.from ? item.from->range() : item.name.range};
    elaboration.problem.task->unknowns.push_back(std::move(unknown));
    return;
  }
  for (Parameter& parameter : elaboration.problem.params) {
    if (parameter.name != item.name.name) continue;
    const bool is_set = elaboration.selection.overrides.contains(parameter.name);  // settings have precedence
    const auto start =
        item.from && !is_set ? evaluate(elaboration, *item.from, "the start of an unknown") : parameter.value;
    unknown.from.formula = model::number(start.value_or(0), {item.from ? item.from->range() : item.name.range});
    unknown.from.origin = (*unknown.from.formula)->origin;
    if (!elaboration.params.values.contains(parameter.name)) parameter.value = start.value_or(0);
  }
  elaboration.problem.task->unknowns.push_back(std::move(unknown));
}

void bind_bounds(Elaboration& elaboration, const ast::UnknownItem& item, Unknown& unknown) {
  if (!item.low || !item.high) return;
  const auto low = evaluate(elaboration, *item.low, "a bound"), high = evaluate(elaboration, *item.high, "a bound");
  if (!low || !high) return;
  unknown.low = *low;
  unknown.high = *high;
  if (*low < *high) return;
  elaboration.sink.report("bad-bounds", item.low->range(), {fmt::format("{}", *low), fmt::format("{}", *high)},
                          "write the smaller number first: unknown nu from 0.01 in 0 .. 1");
}

/// The initial values of an unknown, if known here; fields that vary in space are checked when they are computed.
std::vector<double> starts_of(const Elaboration& elaboration, const Unknown& unknown) {
  if (unknown.kind == Unknown::Kind::control) return elaboration.problem.find_control(unknown.name)->start;
  const auto is_open = [&](const Expr& part) {
    const Param* param = as<Param>(part);
    if (!param) return false;
    const auto value = elaboration.params.values.find(param->name);  // nullopt after an error
    return value == elaboration.params.values.end() || !value->second;
  };
  if (!unknown.from.formula || !is_uniform(*unknown.from.formula) || any_part(*unknown.from.formula, is_open))
    return {};
  const Value value = value_of(*unknown.from.formula, elaboration.params.values);
  return value.mistake.empty() ? std::vector<double>{value.number} : std::vector<double>{};
}

void check_start(Elaboration& elaboration, const ast::UnknownItem& item, const Unknown& unknown) {
  if (!(unknown.low < unknown.high)) return;  // reported
  for (const double start : starts_of(elaboration, unknown)) {
    if (start >= unknown.low && start <= unknown.high) continue;
    elaboration.sink.report(
        "start-out-of-bounds", item.from ? item.from->range() : item.name.range,
        {unknown.name, fmt::format("at {}", start), fmt::format("{}", unknown.low), fmt::format("{}", unknown.high)},
        item.from ? "begin within the bounds, or widen them"
                  : fmt::format("without from it begins with the scene's value: write from {}, or other bounds",
                                unknown.low));
    return;
  }
}

void bind_unknowns(Elaboration& elaboration) {
  std::map<std::pair<bool, std::string>, SourceRange> seen;
  for (const auto& [item, range] : items_of<ast::UnknownItem>(elaboration.blocks.task->items)) {
    bool is_new = true;
    for (const std::string& name : components_of(elaboration, item.name.name)) {
      const auto [first, was_new] = seen.emplace(std::pair(item.initial, name), item.name.range);
      if (!was_new && is_new)
        report_duplicate(elaboration, "unknown " + item.name.name, item.name.range, first->second);
      is_new = is_new && was_new;
    }
    if (!is_new) continue;
    Unknown unknown;
    unknown.name = state_name(item.name.name);
    unknown.origin = {range};
    bind_bounds(elaboration, item, unknown);
    const std::size_t before = elaboration.problem.task->unknowns.size(), mistakes = elaboration.sink.all().size();
    if (item.initial) {
      bind_unknown_states(elaboration, item, unknown);
    } else {
      bind_unknown_values(elaboration, item, unknown);
    }
    const std::vector<Unknown>& bound = elaboration.problem.task->unknowns;
    for (std::size_t i = before; i < bound.size() && elaboration.sink.all().size() == mistakes; ++i)
      check_start(elaboration, item, bound[i]);
  }
  if (!seen.empty() || !items_of<ast::LearnItem>(elaboration.blocks.task->items).empty()) return;
  elaboration.sink.report(
      "incomplete-task", elaboration.blocks.task->name.range, {elaboration.blocks.task->name.name, "find"},
      "write unknown initial u from 0, or unknown and the name of a parameter, or learn and the name of a network");
}

/// A loss without a varying part has a useless derivative: a factor of 0, or a constant.
bool check_loss(Elaboration& elaboration, const ast::MinimiseItem& item, const Expr& value) {
  const bool varies = holds_any<Field, Param>(value);
  if (varies) return true;
  elaboration.sink.report("constant-loss", item.loss.range(), {is_literal(value, 0) ? "0" : "the same"},
                          "leave the line out, or write a loss of the state, as mean((u - u_ref)^2)");
  return false;
}

void bind_losses(Elaboration& elaboration) {
  const auto lines = items_of<ast::MinimiseItem>(elaboration.blocks.task->items);
  for (const auto& [item, range] : lines) {
    const When when = when_of(elaboration, item.when, true);
    elaboration.averages.are_taken = true;
    elaboration.averages.of_loss.clear();
    const auto value = quantity_of(elaboration, item.loss, "the loss", when);
    elaboration.averages.are_taken = false;
    if (!value || !check_loss(elaboration, item, *value)) continue;
    if (elaboration.averages.of_loss.empty()) {
      elaboration.problem.task->losses.push_back({*value, when, {range}});
    } else {
      add_loss_of_averages(elaboration, *value, when, range);
    }
  }
  if (!lines.empty()) return;
  elaboration.sink.report("incomplete-task", elaboration.blocks.task->name.range,
                          {elaboration.blocks.task->name.name, "minimise"},
                          "write minimise mean((u - u_ref)^2) at t = 1");
}

/// In a comparison run of another scene, only the tests that name that scene.
bool is_asked_here(const Elaboration& elaboration, const ast::TestItem& item) {
  const std::string& scene = elaboration.selection.beside;
  return scene.empty() || std::ranges::any_of(item.beside, [&](const ast::TestItem::Baseline& beside) {
           return beside.scene.name == scene;
         });
}

/// A number, or the components of a field. False after a diagnostic.
bool bind_value(Elaboration& elaboration, const ast::TestItem& item, Test& test) {
  if (item.kind == ast::TestItem::Kind::test || item.kind == ast::TestItem::Kind::statistic) {
    const auto value = quantity_of(elaboration, item.value, "the test", test.when);
    if (value) test.quantity.value = *value;
    return value.has_value();
  }
  return bind_fields(elaboration, item, test);
}

void bind_tests(Elaboration& elaboration, const std::vector<ast::Item>& items) {
  std::map<std::string, SourceRange> seen;
  for (const auto& [item, range] : items_of<ast::TestItem>(items)) {
    if (!is_asked_here(elaboration, item)) continue;
    const bool fine = can_name_a_quantity(elaboration, item.name, seen);
    if (item.kind == ast::TestItem::Kind::growth) {
      Test growth{{item.name.name, 0.0, {range}}, {}, "", {}};
      bind_test_on(elaboration, item, growth);
      if (fine) elaboration.problem.task->growths.push_back(std::move(growth));
      continue;
    }
    Test test{{item.name.name, 0.0, {range}}, when_of(elaboration, item.when, true), "", {}};
    if (item.kind == ast::TestItem::Kind::statistic) test.kind = Test::Kind::statistic;
    if (item.kind == ast::TestItem::Kind::spectrum) test.kind = Test::Kind::spectrum;
    if (item.kind == ast::TestItem::Kind::correlation) test.kind = Test::Kind::correlation;
    if (!bind_value(elaboration, item, test) || !fine) continue;
    bind_test_on(elaboration, item, test);
    elaboration.problem.task->tests.push_back(std::move(test));
  }
}

}  // namespace

void mark_unknowns(Elaboration& elaboration) {
  if (!elaboration.blocks.task) return;
  elaboration.problem.task.emplace().name = elaboration.blocks.task->name.name;
  if (!elaboration.selection.beside.empty()) return;
  for (const auto& [item, range] : items_of<ast::UnknownItem>(elaboration.blocks.task->items)) {
    for (Parameter& parameter : elaboration.problem.params) {
      if (item.initial || parameter.name != item.name.name) continue;
      parameter.unknown = true;
      elaboration.params.unknowns.insert(parameter.name);
    }
  }
}

/// Unknown weights of networks; the networks must be called somewhere, at least in the loss.
void bind_learned(Elaboration& elaboration) {
  std::map<std::string, SourceRange> seen;
  for (const auto& [item, range] : items_of<ast::LearnItem>(elaboration.blocks.task->items)) {
    const std::string& name = item.network.name;
    const auto [first, is_new] = seen.emplace(name, item.network.range);
    if (!find_declaration<ast::Network>(elaboration.file, name)) {
      elaboration.sink.report("unknown-block", item.network.range, {"network", name},
                              did_you_mean(name, names_of<ast::Network>(elaboration.file)));
    } else if (!is_new) {
      report_duplicate(elaboration, name, item.network.range, first->second);
    } else if (!elaboration.networks.called.contains(name)) {
      elaboration.sink.report("network-not-called", item.network.range, {elaboration.blocks.task->name.name, name},
                              "write after step: u += " + name + "(...), or call it in an equation");
    } else {
      Unknown unknown;
      unknown.kind = Unknown::Kind::network;
      unknown.name = name;
      unknown.origin = {item.network.range};
      const auto given = std::ranges::find(elaboration.problem.weights, name, &GivenWeights::network);
      if (given != elaboration.problem.weights.end()) unknown.from = given->from;
      if (item.from) unknown.from.origin = {item.from->range()};
      if (item.from) unknown.from.file = std::get<ast::Text>((*item.from)->kind).value;
      elaboration.problem.task->unknowns.push_back(std::move(unknown));
    }
  }
}

void bind_task(Elaboration& elaboration) {
  if (!elaboration.blocks.task) return;
  const std::vector<ast::Item> items = items_of_task(elaboration);
  for (const auto& [item, range] : items_of<ast::DataItem>(items)) bind_datum(elaboration, item, range);
  if (!elaboration.selection.beside.empty()) return bind_tests(elaboration, items);
  bind_unknowns(elaboration);
  bind_losses(elaboration);
  bind_tests(elaboration, items);
  bind_learned(elaboration);
  const auto lines = items_of<ast::UsingItem>(elaboration.blocks.task->items);
  for (std::size_t i = 1; i < lines.size(); ++i) {
    report_duplicate(elaboration, "the optimiser", lines[i].range, lines[0].range);
  }
  if (!lines.empty()) elaboration.problem.task->optimiser = optimiser_of(elaboration, lines[0].kind);
  if (elaboration.problem.task->optimiser) elaboration.problem.task->optimiser->origin = {lines[0].range};
  bind_training(elaboration);
  check_written_files(elaboration);
}

}  // namespace dpde::model
