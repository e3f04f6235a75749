// SPDX-License-Identifier: Apache-2.0
// Values of a scene other than numbers: initial states, exact solutions, coefficient fields, accuracy.
#include <fmt/format.h>

#include <algorithm>

#include "model/build.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

/// States, or coefficients, with an initial value in the task.
std::map<std::string, SourceRange> started_by_task(Elaboration& elaboration, bool initial) {
  std::map<std::string, SourceRange> started;
  if (!elaboration.blocks.task) return started;
  for (const auto& [unknown, range] : items_of<ast::UnknownItem>(elaboration.blocks.task->items)) {
    if (unknown.initial != initial || !unknown.from) continue;
    for (const std::string& name : components_of(elaboration, unknown.name.name))
      started.emplace(name, unknown.name.range);
  }
  return started;
}

/// Calls `bind` with each item and its states; each state is allowed once.
template <class Item, class Bind>
std::map<std::string, SourceRange> for_each_target(Elaboration& elaboration, const std::string& article,
                                                   const std::string& word, const Bind& bind) {
  std::map<std::string, SourceRange> seen;
  for (const auto& [item, range] : items_of<Item>(elaboration.blocks.scene->items)) {
    const std::vector<State*> states = find_states(elaboration, item.field, article + " " + word);
    if (!states.empty() && is_first(elaboration, "the " + word, item.field, states, seen)) bind(item, states);
  }
  return seen;
}

/// initial u = load("run.nc") at t = 1: only .nc files contain times.
void bind_time_of(Elaboration& elaboration, const ast::Expr& at, Source& source) {
  if (source.file.ends_with(".nc")) {
    source.time = evaluate(elaboration, at, "a time");
  } else if (source.formula || !source.file.empty()) {
    elaboration.sink.report("not-allowed-here", at.range(), {"a time", "an initial state that is not from a .nc file"},
                            "write load(\"name.nc\", u) at t = 0.5");
  }
}

}  // namespace

bool is_load(const ast::Expr& e) {
  const auto* call = std::get_if<ast::Call>(&e->kind);
  return call && call->callee == "load";
}

std::optional<LoadedFile> file_of(Elaboration& elaboration, const ast::Expr& e) {
  if (!is_load(e)) return std::nullopt;
  const auto* call = std::get_if<ast::Call>(&e->kind);
  const std::vector<ast::Argument>& arguments = call->arguments;
  const bool positional = std::all_of(arguments.begin(), arguments.end(), [](const auto& a) { return a.name.empty(); });
  const bool fits = positional && (arguments.size() == 1 || arguments.size() == 2);
  const auto* file = fits ? std::get_if<ast::Text>(&arguments[0].value->kind) : nullptr;
  const auto* variable = fits && arguments.size() == 2 ? std::get_if<ast::Name>(&arguments[1].value->kind) : nullptr;
  if (file && !file->value.empty() && (variable || arguments.size() == 1)) {
    const bool holds_names = file->value.ends_with(".nc");
    if (!variable || holds_names) return LoadedFile{file->value, variable ? variable->name : ""};
  }
  elaboration.sink.report("bad-load", e.range(), {},
                          "write load(\"name.npy\"), load(\"name.nc\") or load(\"name.nc\", u)");
  return LoadedFile{};
}

std::vector<Source> sources_of(Elaboration& elaboration, const ast::Expr& e, FormulaContext context,
                               const std::string& subject) {
  const std::size_t count = components_of(elaboration, subject).size();
  std::vector<Source> sources(count);
  const auto* tuple = std::get_if<ast::Tuple>(&e->kind);
  const bool has_files = tuple && std::any_of(tuple->elements.begin(), tuple->elements.end(), is_load);
  if (count > 1 && has_files && tuple->elements.size() == count) {
    for (std::size_t i = 0; i < count; ++i) {
      sources[i] = sources_of(elaboration, tuple->elements[i], context, components_of(elaboration, subject)[i]).front();
    }
    return sources;
  }
  for (Source& source : sources) source.origin = {e.range()};
  if (count == 1 && is_load(e)) {
    const LoadedFile file = file_of(elaboration, e).value_or(LoadedFile{});
    sources.front().file = file.file;
    sources.front().variable = file.variable;
  } else if (const auto formulas = formulas::components({elaboration, context, subject}, e, subject)) {
    for (std::size_t i = 0; i < count; ++i) sources[i].formula = (*formulas)[i];
  }
  return sources;
}

bool is_first(Elaboration& elaboration, const std::string& what, const ast::Identifier& name,
              const std::vector<State*>& states, std::map<std::string, SourceRange>& seen) {
  for (const State* state : states) {
    const auto [first, is_new] = seen.emplace(state->name, name.range);
    if (is_new) continue;
    report_duplicate(elaboration, fmt::format("{} of {}", what, states.size() == 1 ? state->name : name.name),
                     name.range, first->second);
    return false;
  }
  return true;
}

void bind_states(Elaboration& elaboration) {
  auto started = for_each_target<ast::InitialItem>(
      elaboration, "an", "initial state", [&](const ast::InitialItem& item, const std::vector<State*>& states) {
        const std::vector<Source> sources =
            sources_of(elaboration, item.value, FormulaContext::initial, item.field.name);
        for (std::size_t i = 0; i < states.size(); ++i) states[i]->initial = sources[i];
        for (State* state : states) {
          if (item.at) bind_time_of(elaboration, *item.at, state->initial);
          if (item.projected) state->projected = Origin{*item.projected};
        }
      });
  started.merge(started_by_task(elaboration, true));
  for (const std::string& name : states_not_in(elaboration, started)) {
    if (elaboration.solves.multipliers.contains(name)) {
      std::ranges::find(elaboration.problem.states, name, &State::name)->initial.formula = Expr(0.0);
      continue;
    }
    const std::string written = written_name(elaboration, name);
    elaboration.sink.report("missing-initial", elaboration.blocks.scene->name.range, {written},
                            fmt::format("write initial {} = 0 in scene {}", written, elaboration.problem.scene));
  }
  for_each_target<ast::ExactItem>(
      elaboration, "an", "exact solution", [&](const ast::ExactItem& item, const std::vector<State*>& states) {
        const auto exact =
            formulas::components({elaboration, FormulaContext::exact, item.field.name}, item.value, item.field.name);
        for (std::size_t i = 0; exact && i < states.size(); ++i) states[i]->exact = (*exact)[i];
      });
}

namespace {

void bind_coefficient(Elaboration& elaboration, const ast::ValueItem& item, std::map<std::string, SourceRange>& seen) {
  const std::vector<std::string> names = components_of(elaboration, item.name.name);
  for (const std::string& name : names) {
    const auto [first, is_new] = seen.emplace(name, item.name.range);
    if (!is_new)
      return report_duplicate(elaboration, names.size() == 1 ? name : item.name.name, item.name.range, first->second);
  }
  const Coefficient* first = elaboration.problem.find_coefficient(names.front());
  const bool is_control = first && first->is_control();
  if (item.every && !is_control) {
    elaboration.sink.report("not-allowed-here", item.every->range(), {"an interval", "the value of " + item.name.name},
                            fmt::format("declare it in the model: control field {}", item.name.name));
  }
  const int every =
      is_control && item.every ? interval_of(elaboration, *item.every, "a control field").value_or(1) : is_control;
  const bool is_bound = elaboration.masks.moving.contains(item.name.name) || (first && first->is_mask);
  if (is_bound && !is_load(item.value)) return;  // by bind_masks
  const std::vector<Source> sources =
      sources_of(elaboration, item.value, is_control ? FormulaContext::control_field : FormulaContext::coefficient,
                 item.name.name);
  for (std::size_t i = 0; i < names.size(); ++i) {
    for (Coefficient& coefficient : elaboration.problem.coefficients) {
      if (coefficient.name != names[i]) continue;
      coefficient.value = sources[i];
      coefficient.every = every;
    }
  }
}

}  // namespace

void bind_coefficients(Elaboration& elaboration) {
  std::map<std::string, SourceRange> seen;
  for (const auto& [item, range] : items_of<ast::ValueItem>(elaboration.blocks.scene->items)) {
    const Symbol* meaning = elaboration.names.scope.find(item.name.name);
    if (!meaning || meaning->role != Role::coefficient) {
      // an unknown name without a dot was reported by bind_parameters
      const auto no_candidates = [] { return std::vector<std::string>(); };
      if (!meaning && !vector_of(item.name.name).empty()) report_unknown(elaboration, item.name, no_candidates);
      continue;
    }
    bind_coefficient(elaboration, item, seen);
  }
  seen.merge(started_by_task(elaboration, false));
  for (const Coefficient& coefficient : elaboration.problem.coefficients) {
    if (seen.contains(coefficient.name)) continue;
    Diagnostic& diagnostic =
        elaboration.sink.report("missing-value", elaboration.blocks.scene->name.range,
                                {coefficient.is_control() ? "control field" : "coefficient", coefficient.name},
                                fmt::format("write {0} = 1 or {0} = load(\"name.npy\") in scene {1}", coefficient.name,
                                            elaboration.problem.scene));
    diagnostic.notes.push_back({elaboration.names.scope.find(coefficient.name)->declared, "it is declared here"});
  }
}

void bind_accuracy(Elaboration& elaboration) {
  std::optional<SourceRange> first;
  for (const auto& [item, range] : items_of<ast::AccuracyItem>(elaboration.blocks.scene->items)) {
    if (first) report_duplicate(elaboration, "the accuracy", range, *first);
    first = first.value_or(range);
    Accuracy accuracy{evaluate(elaboration, item.tolerance, "an accuracy").value_or(1), {}};
    if (!(accuracy.tolerance > 0))
      elaboration.sink.report("bad-step", item.tolerance.range(), {"accuracy", fmt::format("{}", accuracy.tolerance)});
    for (const ast::Identifier& field : item.fields) {
      for (const State* state : find_states(elaboration, field, "an accuracy")) accuracy.states.push_back(state->name);
    }
    elaboration.problem.accuracy = std::move(accuracy);
  }
}

}  // namespace dpde::model
