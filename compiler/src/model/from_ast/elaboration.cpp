// SPDX-License-Identifier: Apache-2.0
#include "model/from_ast/elaboration.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>

namespace dpde::model {

const std::string* Settings::find(const std::string& key) {
  known_.push_back(key);
  const auto found = texts_.find(key);
  return found == texts_.end() ? nullptr : &found->second;
}

int axis_of(const Elaboration& elaboration, const std::string& name) {
  const auto found = elaboration.names.axis_names.find(name);
  return found == elaboration.names.axis_names.end() ? axis_of(name) : found->second;
}

std::string written_axis(const Elaboration& elaboration, std::size_t axis) {
  const auto is_it = [&](const auto& named) { return named.second == static_cast<int>(axis); };
  const auto found = std::ranges::find_if(elaboration.names.axis_names, is_it);
  return found == elaboration.names.axis_names.end() ? axis_name(static_cast<int>(axis)) : found->first;
}

bool declare(Elaboration& elaboration, const ast::Identifier& name, Role role, bool is_vector) {
  if (is_reserved(name.name)) {
    elaboration.sink.report("reserved-name", name.range, {name.name, std::string(word_for(role))},
                            "choose another name");
    elaboration.names.scope.refuse(name.name);
    return false;
  }
  if (const Symbol* first = elaboration.names.scope.find(name.name)) {
    report_duplicate(elaboration, name.name, name.range, first->declared);
    return false;
  }
  elaboration.names.scope.declare(name.name, {role, name.range, -1, is_vector});
  return true;
}

std::vector<std::string> components_of(const Elaboration& elaboration, const std::string& written) {
  const std::string name = state_name(written);
  const Symbol* meaning = elaboration.names.scope.find(name);
  if (!meaning || !meaning->is_vector) return {name};
  std::vector<std::string> names;
  for (const Axis& axis : elaboration.problem.axes) names.push_back(name + "." + axis.name);
  return names;
}

std::vector<std::string> declare_components(Elaboration& elaboration, const std::string& name) {
  std::vector<std::string> names = components_of(elaboration, name);
  const Symbol meaning = *elaboration.names.scope.find(name);
  for (const std::string& component : names)
    elaboration.names.scope.declare(component, {meaning.role, meaning.declared});
  return names;
}

void report_unknown(Elaboration& elaboration, const ast::Identifier& name,
                    const std::function<std::vector<std::string>()>& candidates) {
  if (elaboration.names.scope.is_refused(name.name)) return;
  const std::string base = vector_of(name.name);
  const Symbol* vector = elaboration.names.scope.find(base);
  if (!vector) {
    elaboration.sink.report("unknown-name", name.range, {name.name},
                            [&] { return did_you_mean(name.name, candidates()); });
    return;
  }
  const auto found = elaboration.names.lets.find(base);
  const bool is_vector =
      vector->is_vector || (found != elaboration.names.lets.end() && found->second.type == TypedExpr::Type::vector);
  if (!is_vector) {
    const bool is_field = vector->role == Role::state;
    elaboration.sink.report("no-components", name.range,
                            {base, is_field ? "field" : std::string(word_for(vector->role))},
                            is_field ? fmt::format("declare it with vector {0} in place of field {0}", base) : "");
    return;
  }
  const std::string part = name.name.substr(base.size() + 1);
  std::vector<std::string> axes;
  for (const Axis& axis : elaboration.problem.axes) axes.push_back(base + "." + axis.name);
  elaboration.sink.report("missing-axis", name.range, {part},
                          fmt::format("components of {}: {}", base, fmt::join(axes, ", ")));
}

void report_duplicate(Elaboration& elaboration, const std::string& what, SourceRange range, SourceRange first) {
  Diagnostic& diagnostic = elaboration.sink.report("duplicate", range, {what});
  if (first.is_known()) diagnostic.notes.push_back({first, "the first is here"});
}

std::vector<State*> find_states(Elaboration& elaboration, const ast::Identifier& written, const std::string& thing,
                                const std::string& hint) {
  const std::string field = rated_field(written.name);
  if (elaboration.names.scope.is_refused(field)) return {};
  if (!field.empty() && !elaboration.problem.velocity_of(components_of(elaboration, field).front())) {
    elaboration.sink.report("unknown-name", written.range, {written.name},
                            "dt(u) is a field of its own only where the model has dt(dt(u)) = ...");
    return {};
  }
  const ast::Identifier name{state_name(written.name), written.range};
  const Symbol* meaning = elaboration.names.scope.find(name.name);
  std::vector<State*> states;
  if (!meaning) {
    report_unknown(elaboration, name, [&] { return elaboration.names.scope.names(Role::state); });
  } else if (meaning->role != Role::state && !elaboration.names.scope.is_refused(name.name)) {
    const Coefficient* coefficient =
        elaboration.problem.find_coefficient(components_of(elaboration, name.name).front());
    const bool is_control = coefficient ? coefficient->is_control() : elaboration.params.controls.contains(name.name);
    const std::string word =
        is_control ? (coefficient ? "control field" : "control") : std::string(word_for(meaning->role));
    elaboration.sink.report("not-a-field", name.range, {name.name, word, thing}, hint);
  } else if (meaning->role == Role::state) {
    for (const std::string& component : components_of(elaboration, name.name)) {
      for (State& state : elaboration.problem.states) {
        if (state.name == component) states.push_back(&state);
      }
    }
  }
  return states;
}

std::string written_name(const Elaboration& elaboration, const std::string& name) {
  const State* state = elaboration.problem.find_state(components_of(elaboration, name).front());
  if (!state || state->velocity_of.empty()) return name;
  return fmt::format("dt({})", vector_of(name).empty() && !vector_of(state->name).empty()
                                   ? vector_of(state->velocity_of)
                                   : state->velocity_of);
}

std::vector<std::string> states_not_in(const Elaboration& elaboration, const std::map<std::string, SourceRange>& seen) {
  std::vector<std::string> missing;
  for (const State& state : elaboration.problem.states) {
    if (seen.contains(state.name)) continue;
    const std::string vector = vector_of(state.name);
    const Symbol* meaning = elaboration.names.scope.find(vector);
    bool all = meaning && meaning->is_vector;
    if (all) {
      for (const std::string& component : components_of(elaboration, vector)) all = all && !seen.contains(component);
    }
    const std::string& name = all ? vector : state.name;
    if (missing.empty() || missing.back() != name) missing.push_back(name);
  }
  return missing;
}

}  // namespace dpde::model
