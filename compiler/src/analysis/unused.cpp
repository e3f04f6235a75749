// SPDX-License-Identifier: Apache-2.0
#include "analysis/unused.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

#include "driver/memory/savings.h"
#include "stencil/build.h"
#include "stencil/passes/passes.h"

namespace dpde::analysis {

namespace {

using Names = std::set<std::string>;

/// Fields, parameters and networks on which the named results of a program depend, by eliminating dead code.
Names sources_of(const driver::Compiled& compiled, const std::string& program, const Names& results) {
  if (compiled.stencil.find_program(program) == nullptr) return {};
  stencil::Module part = driver::extract(compiled.stencil, {program});
  stencil::Program& only = part.programs.front();
  std::erase_if(only.swaps, [&](const stencil::Swap& swap) { return !results.contains(swap.state); });
  std::erase_if(only.keeps, [&](const std::string& field) { return !results.contains(field); });
  part = stencil::remove_dead_code(part);
  const stencil::Interface needs = stencil::interface_of(part, part.programs.front());
  Names sources(needs.inputs.begin(), needs.inputs.end());
  sources.insert(needs.params.begin(), needs.params.end());
  sources.insert(needs.networks.begin(), needs.networks.end());
  return sources;
}

/// Inputs that a program reads.
Names inputs_of(const driver::Compiled& compiled, const std::string& program) {
  const stencil::Program* found = compiled.stencil.find_program(program);
  if (found == nullptr) return {};
  const stencil::Interface needs = stencil::interface_of(compiled.stencil, *found);
  return {needs.inputs.begin(), needs.inputs.end()};
}

/// Dependences in one step, and in the formulas before the first step.
class Dependence {
 public:
  explicit Dependence(const driver::Compiled& compiled) : problem_(*compiled.problem) {
    const Names rate = sources_of(compiled, compiled.names.rate, {compiled.names.rate_field});
    for (const model::State& state : problem_.states) {
      step_[state.name] = sources_of(compiled, compiled.step_name(), {state.name});
      step_[state.name].insert(rate.begin(), rate.end());  // inputs of the number of substeps
      formula_[state.name] = sources_of(compiled, compiled.names.initial, {state.name});
    }
    for (const model::Coefficient& c : problem_.coefficients) {
      const auto control = compiled.names.controls.find(c.name);
      const bool is_control = control != compiled.names.controls.end();
      formula_[c.name] = sources_of(compiled, is_control ? control->second : compiled.names.coefficients, {c.name});
    }
  }

  /// All states on which `wanted` depend, after any number of steps.
  Names behind(Names wanted) const {
    for (std::size_t before = 0; before != wanted.size();) {
      before = wanted.size();
      for (const auto& [state, sources] : step_) {
        if (wanted.contains(state)) wanted.insert(sources.begin(), sources.end());
      }
    }
    return wanted;
  }

  /// All fields that depend on `changed`, after any number of steps.
  Names reached_by(Names changed) const {
    for (std::size_t before = 0; before != changed.size();) {
      before = changed.size();
      for (const std::map<std::string, Names>* links : {&formula_, &step_}) {
        for (const auto& [name, sources] : *links) {
          if (std::ranges::any_of(sources, [&](const std::string& s) { return changed.contains(s); }))
            changed.insert(name);
        }
      }
    }
    return changed;
  }

 private:
  const model::Problem& problem_;
  std::map<std::string, Names> step_, formula_;
};

void add_all(Names& names, const Names& more) { names.insert(more.begin(), more.end()); }

Names read_by_losses(const driver::Compiled& compiled) {
  Names read;
  for (const std::string& loss : compiled.names.losses) add_all(read, inputs_of(compiled, loss));
  return read;
}

/// Requested results; empty: the states themselves.
Names observed(const driver::Compiled& compiled) {
  const model::Problem& problem = *compiled.problem;
  Names seen = read_by_losses(compiled);
  for (const auto& [test, program] : compiled.names.tests) add_all(seen, inputs_of(compiled, program));
  add_all(seen, inputs_of(compiled, compiled.names.observe));
  add_all(seen, inputs_of(compiled, compiled.names.shown));
  for (const model::Output& output : problem.outputs) seen.insert(output.fields.begin(), output.fields.end());
  for (const model::State& state : problem.states) {
    if (state.exact) seen.insert(state.name);
  }
  return seen;
}

/// False for states added by a scheme or by a second-order equation.
bool is_declared(const model::State& state) { return state.history_of.empty() && state.velocity_of.empty(); }
/// True if a constraint computes it, used or not.
bool is_multiplier(const driver::Compiled& compiled, const std::string& state) {
  return compiled.problem->find_projection(state) != nullptr;
}

void add_fields(const driver::Compiled& compiled, const Dependence& dependence, std::vector<Unused>& result) {
  const Names seen = observed(compiled);
  if (seen.empty()) return;
  const Names needed = dependence.behind(seen);
  for (const model::State& state : compiled.problem->states) {
    const bool is_asked_for = is_declared(state) && !is_multiplier(compiled, state.name);
    if (!is_asked_for || needed.contains(state.name)) continue;
    result.push_back({Unused::Kind::field, state.name,
                      "nothing that is observed depends on it; a run computes it all the same", state.origin.range});
  }
}

Names sought(const model::Task& task) {
  Names names;
  for (const model::Unknown& unknown : task.unknowns) names.insert(unknown.name);
  return names;
}

void add_adjoints(const driver::Compiled& compiled, const Dependence& dependence, std::vector<Unused>& result) {
  const model::Problem& problem = *compiled.problem;
  if (!problem.task) return;
  const Names needed = dependence.behind(read_by_losses(compiled)),
              reached = dependence.reached_by(sought(*problem.task));
  for (const model::State& state : problem.states) {
    if (!is_declared(state) || (needed.contains(state.name) && reached.contains(state.name))) continue;
    result.push_back({Unused::Kind::adjoint, state.name,
                      needed.contains(state.name) ? "nothing that is sought reaches it: its adjoint is of no use"
                                                  : "no loss depends on it: its adjoint is 0",
                      state.origin.range});
  }
  const Names read = inputs_of(compiled, compiled.step_name());
  for (const model::Coefficient& c : problem.coefficients) {
    if (!read.contains(c.name) || compiled.activity.fields.contains(c.name)) continue;
    result.push_back(
        {Unused::Kind::adjoint, c.name, "it is not sought: no derivative by it is compiled", c.value.origin.range});
  }
}

/// All fields of a grid have ghost layers of one width, that of the widest stencil of a run or of a task's gradient.
void add_halos(const driver::Compiled& compiled, std::vector<Unused>& result) {
  const model::Problem& problem = *compiled.problem;
  using Halo = std::array<int, stencil::max_rank>;
  std::map<std::string, Halo> read;
  Halo widest{};
  for (const stencil::Program& program : compiled.stencil.programs) {
    if (!problem.task && std::ranges::find(compiled.primal_programs, program.name) == compiled.primal_programs.end())
      continue;
    for (const auto& [field, halo] : stencil::required_halo(compiled.stencil, program)) {
      for (std::size_t a = 0; a < halo.size(); ++a) {
        read[field][a] = std::max(read[field][a], halo[a]);
        widest[a] = std::max(widest[a], halo[a]);
      }
    }
  }
  const auto add = [&](const std::string& name, const SourceRange& place) {
    if (!read.contains(name)) return;
    std::vector<std::string> idle;
    int cells = 0;
    for (std::size_t a = 0; a < problem.axes.size(); ++a) {
      if (widest[a] == 0 || read.at(name)[a] > 0) continue;
      idle.push_back(problem.axes[a].name);
      cells = std::max(cells, widest[a]);
    }
    if (idle.empty()) return;
    result.push_back({Unused::Kind::halo, name,
                      fmt::format("no read of it leaves its cell along {}: {} cell{} on each side {} for other fields",
                                  fmt::join(idle, " and "), cells, cells == 1 ? "" : "s", cells == 1 ? "is" : "are"),
                      place});
  };
  if (!model::is_implicit(problem.scheme.time)) {  // otherwise the unknown of the solve is read instead of the state
    for (const model::State& state : problem.states) add(state.name, state.origin.range);
  }
  for (const model::Coefficient& c : problem.coefficients) add(c.name, c.value.origin.range);
}

/// Reports states stored for the reverse sweep that it does not read.
void add_histories(const driver::Compiled& compiled, std::vector<Unused>& result) {
  const model::Problem& problem = *compiled.problem;
  const auto derived = compiled.derived.find(compiled.step_name());
  if (!problem.task || derived == compiled.derived.end() || !derived->second.adjoint) return;
  const bool keeps = driver::keeps_states(compiled);
  const Names read = inputs_of(compiled, derived->second.adjoint->program);
  for (const model::State& state : problem.states) {
    if (!is_declared(state) || read.contains(state.name)) continue;
    result.push_back({Unused::Kind::history, state.name,
                      keeps
                          ? "the adjoint of a step reads none of its states; other readers of the state keep it stored"
                          : "the adjoint of a step reads none of its states: none is stored",
                      state.origin.range});
  }
}

/// Includes the scene's text and its settings: other numbers may need more digits.
std::string key_of_precision(const driver::Compiled& compiled, const SourceFile& source) {
  std::string key = fmt::format("precision\n{}\n{}\n", compiled.problem->scene, compiled.options.selection.scheme);
  for (const auto& [name, value] : compiled.options.selection.overrides) {
    if (name != "real") key += fmt::format("{}={}\n", name, value);
  }
  return key + std::string(source.text());
}

}  // namespace

std::vector<Unused> idle_precision(const driver::Compiled& compiled, const SourceFile& source) {
  codegen::CodeCache* const cache = compiled.options.cache.get();
  if (cache == nullptr || compiled.real() != Precision::f64) return {};
  const std::optional<std::string> known = cache->find(key_of_precision(compiled, source));
  return known ? std::vector<Unused>{{Unused::Kind::precision, "f64", *known}} : std::vector<Unused>{};
}

void keep_single_precision(const driver::Compiled& compiled, const SourceFile& source, double tolerance, double error) {
  codegen::CodeCache* const cache = compiled.options.cache.get();
  if (cache == nullptr) return;
  cache->store(key_of_precision(compiled, source),
               fmt::format("dpde tune found an error of {:.2g} with f32, for a tolerance of {:g}", error, tolerance));
}

std::string word_of(Unused::Kind kind) {
  switch (kind) {
    case Unused::Kind::field: return "field";
    case Unused::Kind::adjoint: return "adjoint";
    case Unused::Kind::halo: return "halo";
    case Unused::Kind::axis: return "axis";
    case Unused::Kind::history: return "history";
    case Unused::Kind::precision: return "precision";
  }
  return "";
}

std::vector<Unused> unused_parts(const driver::Compiled& compiled) {
  std::vector<Unused> result;
  const Dependence dependence(compiled);
  add_fields(compiled, dependence, result);
  add_adjoints(compiled, dependence, result);
  add_halos(compiled, result);
  add_histories(compiled, result);
  return result;
}

}  // namespace dpde::analysis
