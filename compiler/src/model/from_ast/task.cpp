// SPDX-License-Identifier: Apache-2.0
// What is asked of the scene: data, unknowns, losses, tests, and the optimiser.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "model/build.h"
#include "model/from_ast/expressions.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

constexpr const char* data_hint = "write load(\"name.npy\"), or u from scene NAME at t = 1";

std::vector<std::string> fields_of(const Draft& draft, const ast::Scene& scene) {
  std::vector<std::string> fields;
  if (const auto* model = find_declaration<ast::Model>(draft.file, scene.of.name)) {
    for (const auto& [item, range] : items_of<ast::FieldItem>(model->items)) {
      for (const ast::Identifier& name : item.names) fields.push_back(name.name);
    }
  } else if (const auto* program = find_declaration<ast::Program>(draft.file, scene.of.name)) {
    for (const auto& [swap, range] : items_of<ast::SwapItem>(program->items)) fields.push_back(swap.state.name);
  }
  return fields;
}

/// Data that are the field of a scene's run.
void bind_run(Draft& draft, const ast::DataItem& item, Datum& datum) {
  const auto* field = std::get_if<ast::Name>(&item.value->kind);
  if (!field) {
    draft.sink.report("bad-data", item.value.range(), {}, data_hint);
    return;
  }
  const auto* scene = find_declaration<ast::Scene>(draft.file, item.scene->name);
  if (!scene) {
    draft.sink.report("unknown-block", item.scene->range, {"scene", item.scene->name},
                      did_you_mean(item.scene->name, names_of<ast::Scene>(draft.file)));
    return;
  }
  datum.scene = item.scene->name;
  datum.field = field->name;
  const std::vector<std::string> fields = fields_of(draft, *scene);
  if (std::find(fields.begin(), fields.end(), field->name) != fields.end()) return;
  draft.sink.report("no-such-field", item.value.range(), {datum.scene, field->name}, did_you_mean(field->name, fields));
}

void bind_datum(Draft& draft, const ast::DataItem& item, SourceRange range) {
  const bool is_new = declare(draft, item.name, Role::datum);
  Datum datum;
  datum.name = item.name.name;
  datum.origin = {range};
  datum.when = when_of(draft, item.when, item.scene && item.scene->name == draft.problem.scene);
  if (item.scene) {
    bind_run(draft, item, datum);
  } else if (const auto file = file_of(draft, item.value)) {
    datum.file = *file;
  } else {
    draft.sink.report("bad-data", item.value.range(), {}, data_hint);
  }
  if (is_new) draft.problem.task->data.push_back(std::move(datum));
}

void bind_unknown_state(Draft& draft, const ast::UnknownItem& item, Unknown& unknown) {
  if (!find_state(draft, item.name, "an initial state")) return;
  for (State& state : draft.problem.states) {
    if (state.name != item.name.name) continue;
    if (item.from) unknown.from = source_of(draft, *item.from, Purpose::initial, state.name);
    if (!item.from) unknown.from = state.initial;
    const bool has_initial = state.initial.formula || !state.initial.file.empty();
    if (!has_initial) state.initial = unknown.from;
  }
}

void bind_unknown_param(Draft& draft, const ast::UnknownItem& item, Unknown& unknown) {
  const Meaning* meaning = draft.scope.find(item.name.name);
  if (!meaning) {
    draft.sink.report("unknown-name", item.name.range, {item.name.name},
                      did_you_mean(item.name.name, draft.scope.names(Role::parameter)));
    return;
  }
  if (meaning->role != Role::parameter) {
    draft.sink.report("not-an-unknown", item.name.range, {item.name.name, std::string(word_for(meaning->role))},
                      meaning->role == Role::state ? fmt::format("write unknown initial {}", item.name.name)
                                                   : "unknowns are parameters and initial states");
    return;
  }
  for (Parameter& parameter : draft.problem.params) {
    if (parameter.name != item.name.name) continue;
    const auto start = item.from ? evaluate(draft, *item.from, "the start of an unknown") : parameter.value;
    unknown.from.formula = model::number(start.value_or(0), {item.from ? item.from->range() : item.name.range});
    unknown.from.origin = (*unknown.from.formula)->origin;
    if (!draft.values.contains(parameter.name)) parameter.value = start.value_or(0);
  }
}

void bind_unknowns(Draft& draft) {
  std::map<std::pair<bool, std::string>, SourceRange> seen;
  for (const auto& [item, range] : items_of<ast::UnknownItem>(draft.task->items)) {
    const auto [first, is_new] = seen.emplace(std::pair(item.initial, item.name.name), item.name.range);
    if (!is_new) {
      report_duplicate(draft, "unknown " + item.name.name, item.name.range, first->second);
      continue;
    }
    Unknown unknown;
    unknown.initial = item.initial;
    unknown.name = item.name.name;
    unknown.origin = {range};
    if (item.initial) bind_unknown_state(draft, item, unknown);
    if (!item.initial) bind_unknown_param(draft, item, unknown);
    draft.problem.task->unknowns.push_back(std::move(unknown));
  }
  if (!seen.empty()) return;
  draft.sink.report("incomplete-task", draft.task->name.range, {draft.task->name.name, "find"},
                    "write unknown initial u from 0, or unknown and the name of a parameter");
}

void bind_losses(Draft& draft) {
  const auto lines = items_of<ast::MinimiseItem>(draft.task->items);
  for (const auto& [item, range] : lines) {
    const auto value = quantity_of(draft, item.loss, "the loss");
    const When when = when_of(draft, item.when, true);
    if (value) draft.problem.task->losses.push_back({*value, when, {range}});
  }
  if (!lines.empty()) return;
  draft.sink.report("incomplete-task", draft.task->name.range, {draft.task->name.name, "minimise"},
                    "write minimise mean((u - u_ref)^2) at t = 1");
}

void bind_tests(Draft& draft) {
  std::map<std::string, SourceRange> seen;
  for (const auto& [item, range] : items_of<ast::TestItem>(draft.task->items)) {
    const bool fine = can_name_a_quantity(draft, item.name, seen);
    const auto value = quantity_of(draft, item.value, "the test");
    const When when = when_of(draft, item.when, true);
    if (fine && value) draft.problem.task->tests.push_back({{item.name.name, *value, {range}}, when});
  }
}

}  // namespace

void mark_unknowns(Draft& draft) {
  if (!draft.task) return;
  draft.problem.task.emplace().name = draft.task->name.name;
  for (const auto& [item, range] : items_of<ast::UnknownItem>(draft.task->items)) {
    for (Parameter& parameter : draft.problem.params) {
      if (item.initial || parameter.name != item.name.name) continue;
      parameter.unknown = true;
      draft.unknowns.insert(parameter.name);
    }
  }
}

void bind_task(Draft& draft) {
  if (!draft.task) return;
  for (const auto& [item, range] : items_of<ast::DataItem>(draft.task->items)) bind_datum(draft, item, range);
  bind_unknowns(draft);
  bind_losses(draft);
  bind_tests(draft);
  const auto lines = items_of<ast::UsingItem>(draft.task->items);
  for (std::size_t i = 1; i < lines.size(); ++i) {
    report_duplicate(draft, "the optimiser", lines[i].range, lines[0].range);
  }
  if (!lines.empty()) draft.problem.task->optimiser = optimiser_of(draft, lines[0].kind);
}

}  // namespace dpde::model
