// SPDX-License-Identifier: Apache-2.0
// Values of parameters, in any order: of settings, else of the scene, else of the model.
#include <fmt/format.h>

#include "model/from_ast/formulas/expressions.h"
#include "model/from_ast/parts.h"
#include "syntax/expand/calls.h"

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

class ParameterValues {
 public:
  explicit ParameterValues(Draft& draft) : draft_(draft) {
    for (const auto& [item, range] : items_of<ast::ValueItem>(draft.scene->items))
      written_.emplace(item.name.name, &item);
    if (!draft.model) return;
    for (const auto& [item, range] : items_of<ast::ParamItem>(draft.model->items)) {
      for (std::size_t i = 0; i < item.names.size(); ++i) {
        if (item.values[i]) defaults_.emplace(item.names[i].name, &*item.values[i]);
      }
    }
  }

  void bind_all() {
    for (const auto& [item, range] : items_of<ast::ValueItem>(draft_.scene->items)) bind(item);
    for (const auto& [name, value] : defaults_) want(name);
  }

 private:
  void bind(const ast::ValueItem& item) {
    if (find_declaration<ast::Network>(draft_.file, item.name.name)) return;  // bind_networks
    const Meaning* meaning = draft_.scope.find(item.name.name);
    const bool is_component = !vector_of(item.name.name).empty() && draft_.scope.find(vector_of(item.name.name));
    if (is_component || (meaning && meaning->role == Role::coefficient)) return;  // bind_coefficients
    if (!meaning || meaning->role != Role::parameter) return report_not_a_value(draft_, item.name, meaning);
    const auto [first, is_new] = seen_.emplace(item.name.name, item.name.range);
    if (!is_new && first->second == item.name.range) return;  // a formula above wanted it
    if (!is_new) return report_duplicate(draft_, item.name.name, item.name.range, first->second);
    evaluate_if_free(item.name.name, item.value);
  }

  void evaluate_if_free(const std::string& name, const ast::Expr& value) {
    if (draft_.values.contains(name) || draft_.controls.contains(name)) return;  // set, or bound later
    want_names_of(value);
    const auto number = evaluate(draft_, value, "the value of " + name);
    draft_.values[name] = number;
  }

  void want_names_of(const ast::Expr& value) {
    ast::for_each_name(value, [&](const std::string& name) { want(vector_of(name).empty() ? name : vector_of(name)); });
  }

  /// The value of a parameter, and of what that is made of.
  void want(const std::string& name) {
    const auto let = draft_.scene_lets.find(name);
    const auto found = defaults_.find(name);
    if (!wanted_.insert(name).second) return;
    if (let != draft_.scene_lets.end()) return want_names_of(*let->second);
    const auto item = written_.find(name);
    if (item != written_.end()) return bind(*item->second);
    if (found != defaults_.end()) evaluate_if_free(name, *found->second);
  }

  Draft& draft_;
  std::map<std::string, const ast::ValueItem*> written_;
  std::map<std::string, const ast::Expr*> defaults_;
  std::map<std::string, SourceRange> seen_;
  std::set<std::string> wanted_;
};

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
  ParameterValues(draft).bind_all();
  for (Parameter& parameter : draft.problem.params) {
    const auto value = draft.values.find(parameter.name);
    if (draft.controls.contains(parameter.name)) continue;
    if (value != draft.values.end()) {
      parameter.value = value->second.value_or(0);
    } else if (!has_start(draft, parameter.name)) {
      Diagnostic& diagnostic =
          draft.sink.report("missing-value", draft.scene->name.range, {"parameter", parameter.name},
                            fmt::format("write {0} = 1 in scene {1}, or param {0} = 1 in the model", parameter.name,
                                        draft.problem.scene));
      diagnostic.notes.push_back({draft.scope.find(parameter.name)->declared, "it is declared here"});
      draft.values[parameter.name] = std::nullopt;
    }
  }
}

}  // namespace dpde::model
