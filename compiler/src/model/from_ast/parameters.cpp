// SPDX-License-Identifier: Apache-2.0
// Values of parameters. A formula may use the parameters that have a value above it; settings stand above everything.
#include <fmt/format.h>

#include "model/from_ast/expressions.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

/// Whether the task gives the unknown parameter a value to start from.
bool has_start(const Draft& draft, const std::string& name) {
  if (!draft.task) return false;
  for (const auto& [unknown, range] : items_of<ast::UnknownItem>(draft.task->items)) {
    if (!unknown.initial && unknown.name.name == name && unknown.from) return true;
  }
  return false;
}

void report_not_a_value(Draft& draft, const ast::Identifier& name, const Meaning* meaning) {
  if (draft.scope.is_refused(name.name)) return;
  if (!meaning) {
    draft.sink.report("unknown-name", name.range, {name.name}, [&] {
      std::vector<std::string> known = draft.scope.names(Role::parameter);
      for (const std::string& coefficient : draft.scope.names(Role::coefficient)) known.push_back(coefficient);
      return did_you_mean(name.name, known);
    });
    return;
  }
  draft.sink.report("not-a-value", name.range, {name.name, std::string(word_for(meaning->role))},
                    meaning->role == Role::state ? fmt::format("write initial {} = ...", name.name) : "");
}

void bind_value(Draft& draft, const ast::ValueItem& item, std::map<std::string, SourceRange>& seen) {
  if (find_declaration<ast::Network>(draft.file, item.name.name)) return;  // bind_networks
  const Meaning* meaning = draft.scope.find(item.name.name);
  const bool is_component = !vector_of(item.name.name).empty() && draft.scope.find(vector_of(item.name.name));
  if (is_component || (meaning && meaning->role == Role::coefficient)) return;  // bind_coefficients
  if (!meaning || meaning->role != Role::parameter) return report_not_a_value(draft, item.name, meaning);
  const auto [first, is_new] = seen.emplace(item.name.name, item.name.range);
  if (!is_new) return report_duplicate(draft, item.name.name, item.name.range, first->second);
  if (draft.values.contains(item.name.name) || draft.controls.contains(item.name.name)) return;  // set, or bound later
  const auto value = evaluate(draft, item.value, "the value of " + item.name.name);
  draft.values[item.name.name] = value;
}

}  // namespace

void bind_parameters(Draft& draft) {
  for (const Parameter& parameter : draft.problem.params) {
    if (!draft.selection.overrides.contains(parameter.name)) {
      draft.settings.add_known(parameter.name);
      continue;
    }
    const auto value = number_setting(draft, parameter.name);
    draft.values[parameter.name] = value;
  }
  std::map<std::string, SourceRange> seen;
  for (const auto& [item, range] : items_of<ast::ValueItem>(draft.scene->items)) bind_value(draft, item, seen);
  for (Parameter& parameter : draft.problem.params) {
    const auto value = draft.values.find(parameter.name);
    if (draft.controls.contains(parameter.name)) continue;
    if (value != draft.values.end()) {
      parameter.value = value->second.value_or(0);
    } else if (!has_start(draft, parameter.name)) {
      Diagnostic& diagnostic =
          draft.sink.report("missing-value", draft.scene->name.range, {"parameter", parameter.name},
                            fmt::format("write {} = 1 in scene {}", parameter.name, draft.problem.scene));
      diagnostic.notes.push_back({draft.scope.find(parameter.name)->declared, "it is declared here"});
      draft.values[parameter.name] = std::nullopt;
    }
  }
}

}  // namespace dpde::model
