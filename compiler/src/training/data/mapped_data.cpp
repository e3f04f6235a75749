// SPDX-License-Identifier: Apache-2.0
#include "training/data/mapped_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "driver/scene/session.h"
#include "model/from_ast/state_map_from_ast.h"
#include "support/maths/evaluate.h"
#include "training/tests/beside.h"

namespace dpde::training {

namespace {

/// Temporary name of a field's formula, since the task's scene may have a field of that name.
std::string shown_name(const std::string& field) { return field + "_beside"; }

std::string shown_name_of_state(const ast::NamedFormula& of, const std::string& state) {
  return shown_name(of.name.name) + state.substr(of.name.name.size());
}

class MappedData {
 public:
  MappedData(const driver::Compiled& own, const model::Problem& there, model::StateMap map, const SourceFile& source,
             SourceRange where, DiagnosticSink& sink)
      : own_(own), there_(there), map_(std::move(map)), source_(source), where_(where), sink_(sink) {}

  std::optional<files::Trajectories> load(const std::string& file) {
    if (!open() || !has_components()) return std::nullopt;
    model::Problem both = session_->problem();  // parameters of either scene may differ between runs
    for (const model::Parameter& param : there_.params) {
      if (both.find_param(param.name) == nullptr) both.params.push_back(param);
    }
    std::optional<files::Trajectories> from = files::load_trajectories(both, file, source_, where_, sink_);
    if (!from || !has_grid(*from) || !has_fields(*from)) return std::nullopt;
    files::Trajectories to = begin(*from);
    if (to.every == 0 || !make_frames(*from, to)) return std::nullopt;
    return to;
  }

 private:
  bool fail(const files::Trajectories& on, const std::string& what, const std::string& hint = "") {
    sink_.report("bad-array-file", where_, {on.path, what}, hint);
    return false;
  }

  /// Opens the task's own scene on the grid of the other one, with the formulas.
  bool open() {
    driver::CompileOptions options = options_beside(own_, own_.problem->scene);
    options.selection.overrides = own_.options.selection.overrides;
    std::erase_if(options.selection.overrides,
                  [](const auto& setting) { return setting.first == "cells" || setting.first.starts_with("cells."); });
    for (const model::Axis& axis : there_.axes)
      options.selection.overrides["cells." + axis.name] = fmt::format("{}", axis.cells);
    options.selection.shown = map_;
    for (ast::NamedFormula& each : options.selection.shown) each.name.name = shown_name(each.name.name);
    if (!options.backend) options.backend = driver::Backend::jit;  // the interpreter would solve by dense matrices
    options.runs = driver::any_number_of_runs;
    DiagnosticSink within;
    std::optional<driver::Compiled> compiled = driver::compile(source_, options, within);
    if (compiled) {
      driver::SessionOptions session_options;
      session_ = driver::Session::open(source_, std::make_shared<driver::Compiled>(std::move(*compiled)),
                                       session_options, within);
    }
    for (const Diagnostic& each : within.all()) {
      if (each.kind->severity == Severity::error) sink_.add(each);
    }
    return session_ != nullptr;
  }

  /// Checks that vectors are computed from vectors.
  bool has_components() {
    for (const ast::NamedFormula& each : map_) {
      for (const model::State* state : model::states_called(there_, each.name.name)) {
        if (session_->problem().find_shown(shown_name_of_state(each, state->name)) != nullptr) continue;
        sink_.report("bad-option", each.value->range(),
                     {fmt::format("{} of scene {} has {}, and this has none", each.name.name, there_.scene,
                                  state->name == each.name.name ? "one number" : "a component " + state->name)},
                     "a vector is made of a vector, and a number of a number");
        return false;
      }
    }
    return true;
  }

  bool has_grid(const files::Trajectories& on) {
    const std::vector<model::Axis>& own = session_->axes();
    for (std::size_t a = 0; a < there_.axes.size(); ++a) {
      const model::Axis& axis = there_.axes[a];
      const bool is_there = own.size() == there_.axes.size() && own[a].name == axis.name;
      bool fits = is_there && own[a].cells == axis.cells;
      for (int i = 0; fits && i <= axis.cells; ++i)
        fits = std::abs(own[a].face(i) - axis.face(i)) <= 1e-9 * std::abs(axis.high - axis.low);
      if (!fits)
        return fail(on, fmt::format("axis {} of scene {} is another than that of scene {}, where the map is made",
                                    axis.name, there_.scene, own_.problem->scene));
    }
    return own.size() == there_.axes.size() || fail(on, fmt::format("scene {} has other axes", there_.scene));
  }

  /// Checks that the file has all fields of the formulas; otherwise the scene's initial values would be used.
  bool has_fields(const files::Trajectories& on) {
    const stencil::Program* program = session_->compiled().stencil.find_program(session_->compiled().names.shown);
    const dpde_program& table = *session_->compiled().program(session_->compiled().names.shown);
    if (program == nullptr) return true;
    for (const model::State& state : session_->problem().states) {
      const bool is_read = std::ranges::any_of(std::span(table.fields, static_cast<std::size_t>(table.field_count)),
                                               [&](const char* field) { return state.name == field; });
      if (is_read && !state.is_guess && std::ranges::find(on.states, state.name) == on.states.end())
        return fail(on,
                    fmt::format("it has no {}, of which {} of scene {} is made", state.name, map_.front().name.name,
                                there_.scene),
                    fmt::format("it has {}", fmt::join(on.states, ", ")));
    }
    return true;
  }

  const model::State* mapped(const model::State& state) const {
    const auto is_of = [&](const ast::NamedFormula& each) {
      const auto states = model::states_called(there_, each.name.name);
      return std::ranges::find(states, &state) != states.end();
    };
    return std::ranges::any_of(map_, is_of) ? &state : nullptr;
  }

  /// Trajectories without frames; every = 0 after a diagnostic.
  files::Trajectories begin(const files::Trajectories& from) {
    files::Trajectories to = from;
    to.states.clear();
    to.params.clear();
    to.every = 0;
    for (files::Trajectories::Run& run : to.runs) run.params.clear();
    for (std::size_t p = 0; p < from.params.size(); ++p) {
      if (there_.find_param(from.params[p]) == nullptr) continue;
      to.params.push_back(from.params[p]);
      for (std::size_t r = 0; r < to.runs.size(); ++r) to.runs[r].params.push_back(from.runs[r].params[p]);
    }
    for (const model::State& state : there_.states) {
      const model::State* same = session_->problem().find_state(state.name);
      const bool is_there = std::ranges::find(from.states, state.name) != from.states.end();
      if (mapped(state) != nullptr) to.states.push_back(state.name);
      if (mapped(state) != nullptr || same == nullptr || !is_there) continue;
      to.states.push_back(state.name);
      if (same->placement != state.placement) {
        fail(from, fmt::format("{} lies elsewhere in scene {}", state.name, there_.scene),
             fmt::format("make it in the map, as in {} = interpolate({})", state.name, state.name));
        return to;
      }
    }
    for (const model::State& state : there_.states) {
      const auto has = [&](const std::string& name) { return std::ranges::find(to.states, name) != to.states.end(); };
      if (state.velocity_of.empty() || !has(state.velocity_of) || has(state.name)) continue;
      fail(from,
           fmt::format("nothing makes {}, the rate of {} of scene {}", state.name, state.velocity_of, there_.scene),
           fmt::format("give it in the map, too: {} = ...", state.name));
      return to;
    }
    if (!data_lie_alike(from)) return to;
    if (std::optional<files::Trajectories> in_steps = to.in_steps_of(there_.step)) return *std::move(in_steps);
    const double spacing = from.every * session_->problem().step;
    fail(from, fmt::format("its frames are {:.6g} apart, no whole number of steps of {:.6g}", spacing, there_.step));
    return to;
  }

  bool data_lie_alike(const files::Trajectories& from) {
    const auto& data = session_->problem().task->data;
    for (const model::Datum& datum : there_.task->data) {
      const model::State* state = there_.find_state(datum.variable);
      if (state != nullptr && mapped(*state) != nullptr) continue;
      const auto own = std::ranges::find(data, datum.name, &model::Datum::name);
      if (own != data.end() && own->placement == datum.placement && own->variable == datum.variable) continue;
      return fail(from, fmt::format("{} lies elsewhere in scene {}", datum.name, there_.scene));
    }
    return true;
  }

  bool make_frames(const files::Trajectories& from, files::Trajectories& to) {
    for (std::size_t r = 0; r < from.runs.size(); ++r) {
      for (std::size_t p = 0; p < from.params.size(); ++p) {
        if (session_->problem().find_param(from.params[p]) != nullptr)
          session_->engine().set_param(from.params[p], from.runs[r].params[p]);
      }
      std::map<std::string, std::vector<double>> made;
      for (int k = 0; k < from.frame_count(); ++k) {
        for (const std::string& state : from.states)
          session_->workspace().set_dense(state, from.frames(static_cast<int>(r), state, k));
        if (!add_frame(session_->shown(from.times[static_cast<std::size_t>(k)], {}), made))
          return fail(to, fmt::format("what the map makes of run {}, frame {} is not finite", r, k));
      }
      for (auto& [state, values] : made)
        to.runs[r].frames[state] = std::make_shared<const std::vector<double>>(std::move(values));
    }
    return true;
  }

  bool add_frame(const std::map<std::string, std::vector<double>>& shown,
                 std::map<std::string, std::vector<double>>& made) const {
    for (const ast::NamedFormula& each : map_) {
      for (const model::State* state : model::states_called(there_, each.name.name)) {
        const std::vector<double>& values = shown.at(shown_name_of_state(each, state->name));
        if (!std::ranges::all_of(values, [](double value) { return std::isfinite(value); })) return false;
        std::vector<double>& all = made[state->name];
        all.insert(all.end(), values.begin(), values.end());
      }
    }
    return true;
  }

  const driver::Compiled& own_;
  const model::Problem& there_;
  model::StateMap map_;
  const SourceFile& source_;
  SourceRange where_;
  DiagnosticSink& sink_;
  std::unique_ptr<driver::Session> session_;
};

/// The trajectories in the file. If the file has no states of the scene, reports how they could be computed.
std::optional<files::Trajectories> load_as_it_is(const driver::Compiled& own, const model::Problem& scene,
                                                 const std::string& file, const SourceFile& source, SourceRange where,
                                                 DiagnosticSink& sink) {
  DiagnosticSink within;
  std::optional<files::Trajectories> on = files::load_trajectories(scene, file, source, where, within);
  const bool is_other = std::ranges::none_of(
      scene.states, [&](const model::State& state) { return own.problem->find_state(state.name) != nullptr; });
  for (Diagnostic each : within.all()) {
    if (is_other && each.hint.empty() && each.kind->severity == Severity::error)
      each.hint = fmt::format("where tells how its states are made of the task's: beside {} where {} = ...",
                              scene.scene, scene.states.front().name);
    sink.add(std::move(each));
  }
  return on;
}

}  // namespace

std::optional<files::Trajectories> load_beside(const driver::Compiled& own, const model::Problem& scene,
                                               const std::string& file, const SourceFile& source, SourceRange where,
                                               DiagnosticSink& sink) {
  const bool had_errors = sink.has_errors();
  model::StateMap map = model::state_map_to(scene, own.ast, own.problem->task->name, sink);
  if (sink.has_errors() && !had_errors) return std::nullopt;
  if (map.empty()) return load_as_it_is(own, scene, file, source, where, sink);
  return MappedData(own, scene, std::move(map), source, where, sink).load(file);
}

}  // namespace dpde::training
