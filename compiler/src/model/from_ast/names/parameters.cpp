// SPDX-License-Identifier: Apache-2.0
// Values of parameters, in any order: from the settings, else the scene, else the model.
#include <fmt/format.h>

#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"
#include "syntax/expand/calls.h"

namespace dpde::model {

namespace {

/// Whether the task gives the unknown parameter an initial value.
bool has_start(const Elaboration& elaboration, const std::string& name) {
  if (!elaboration.blocks.task) return false;
  for (const auto& [unknown, range] : items_of<ast::UnknownItem>(elaboration.blocks.task->items)) {
    if (!unknown.initial && unknown.name.name == name && unknown.from) return true;
  }
  return false;
}

void report_not_a_value(Elaboration& elaboration, const ast::Identifier& name, const Symbol* meaning) {
  if (elaboration.names.scope.is_refused(name.name)) return;
  if (!meaning) {
    elaboration.sink.report("unknown-name", name.range, {name.name}, [&] {
      std::vector<std::string> known = elaboration.names.scope.names(Role::parameter);
      for (const std::string& coefficient : elaboration.names.scope.names(Role::coefficient))
        known.push_back(coefficient);
      return did_you_mean(name.name, known);
    });
    return;
  }
  elaboration.sink.report("not-a-value", name.range, {name.name, std::string(word_for(meaning->role))},
                          meaning->role == Role::state ? fmt::format("write initial {} = ...", name.name) : "");
}

class ParameterValues {
 public:
  explicit ParameterValues(Elaboration& elaboration) : elaboration_(elaboration) {
    for (const auto& [item, range] : items_of<ast::ValueItem>(elaboration.blocks.scene->items))
      written_.emplace(item.name.name, &item);
    if (!elaboration.blocks.model) return;
    for (const auto& [item, range] : items_of<ast::ParamItem>(elaboration.blocks.model->items)) {
      for (std::size_t i = 0; i < item.names.size(); ++i) {
        if (item.values[i]) defaults_.emplace(item.names[i].name, &*item.values[i]);
      }
    }
  }

  void bind_all() {
    for (const auto& [item, range] : items_of<ast::ValueItem>(elaboration_.blocks.scene->items)) bind(item);
    for (const auto& [name, value] : defaults_) want(name);
  }

 private:
  void bind(const ast::ValueItem& item) {
    if (find_declaration<ast::Network>(elaboration_.file, item.name.name)) return;  // bind_networks
    const Symbol* meaning = elaboration_.names.scope.find(item.name.name);
    const bool is_component =
        !vector_of(item.name.name).empty() && elaboration_.names.scope.find(vector_of(item.name.name));
    if (is_component || (meaning && meaning->role == Role::coefficient)) return;  // bind_coefficients
    if (!meaning || meaning->role != Role::parameter) return report_not_a_value(elaboration_, item.name, meaning);
    const auto [first, is_new] = seen_.emplace(item.name.name, item.name.range);
    if (!is_new && first->second == item.name.range) return;  // evaluated before, for a formula above
    if (!is_new) return report_duplicate(elaboration_, item.name.name, item.name.range, first->second);
    evaluate_if_free(item.name.name, item.value);
  }

  void evaluate_if_free(const std::string& name, const ast::Expr& value) {
    if (elaboration_.params.values.contains(name) || elaboration_.params.controls.contains(name))
      return;  // set, or bound later
    want_names_of(value);
    const auto number = evaluate(elaboration_, value, "the value of " + name);
    elaboration_.params.values[name] = number;
  }

  void want_names_of(const ast::Expr& value) {
    ast::for_each_name(value, [&](const std::string& name) { want(vector_of(name).empty() ? name : vector_of(name)); });
  }

  /// Evaluates a parameter and the names in its formula.
  void want(const std::string& name) {
    const auto let = elaboration_.names.scene_lets.find(name);
    const auto found = defaults_.find(name);
    if (!wanted_.insert(name).second) return;
    if (let != elaboration_.names.scene_lets.end()) return want_names_of(*let->second);
    const auto item = written_.find(name);
    if (item != written_.end()) return bind(*item->second);
    if (found != defaults_.end()) evaluate_if_free(name, *found->second);
  }

  Elaboration& elaboration_;
  std::map<std::string, const ast::ValueItem*> written_;
  std::map<std::string, const ast::Expr*> defaults_;
  std::map<std::string, SourceRange> seen_;
  std::set<std::string> wanted_;
};

}  // namespace

void bind_parameters(Elaboration& elaboration) {
  for (const Parameter& parameter : elaboration.problem.params) {
    if (!elaboration.selection.overrides.contains(parameter.name)) {
      elaboration.settings.add_known(parameter.name);
      continue;
    }
    const auto value = number_setting(elaboration, parameter.name);
    elaboration.params.values[parameter.name] = value;
  }
  ParameterValues(elaboration).bind_all();
  for (Parameter& parameter : elaboration.problem.params) {
    const auto value = elaboration.params.values.find(parameter.name);
    if (elaboration.params.controls.contains(parameter.name)) continue;
    if (value != elaboration.params.values.end()) {
      parameter.value = value->second.value_or(0);
    } else if (!has_start(elaboration, parameter.name)) {
      Diagnostic& diagnostic =
          elaboration.sink.report("missing-value", elaboration.blocks.scene->name.range, {"parameter", parameter.name},
                                  fmt::format("write {0} = 1 in scene {1}, or param {0} = 1 in the model",
                                              parameter.name, elaboration.problem.scene));
      diagnostic.notes.push_back({elaboration.names.scope.find(parameter.name)->declared, "it is declared here"});
      elaboration.params.values[parameter.name] = std::nullopt;
    }
  }
}

}  // namespace dpde::model
