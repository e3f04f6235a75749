// SPDX-License-Identifier: Apache-2.0
#include "driver/scene/scene_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <string>
#include <vector>

#include "codegen/network_table.h"
#include "driver/compile/switches.h"
#include "driver/memory/storage.h"
#include "files/weights.h"
#include "support/assert.h"

namespace dpde::driver {

namespace {

/// Order in the vector of all unknowns; within a kind, the order of the task.
constexpr model::Unknown::Kind order_of_unknowns[] = {model::Unknown::Kind::initial, model::Unknown::Kind::coefficient,
                                                      model::Unknown::Kind::parameter, model::Unknown::Kind::control,
                                                      model::Unknown::Kind::network};

dpde_optimiser optimiser_of(const model::Optimiser& optimiser) {
  const auto method = [&] {
    switch (optimiser.kind) {
      case model::Optimiser::Kind::gradient_descent: return DPDE_GRADIENT_DESCENT;
      case model::Optimiser::Kind::adam: return DPDE_ADAM;
      case model::Optimiser::Kind::lbfgs: return DPDE_LBFGS;
      case model::Optimiser::Kind::newton_cg: return DPDE_NEWTON_CG;
    }
    unreachable("kind of optimiser");
  };
  return {method(), optimiser.rate, optimiser.gauss_newton, optimiser.iterations};
}

}  // namespace

std::optional<Compiled> compile_for_hosts(const SourceFile& source, model::Selection selection,
                                          std::optional<Backend> backend, const HostNeeds& needs,
                                          DiagnosticSink& sink) {
  CompileOptions options;
  options.seeded = needs.seeded;
  options.takes_jumps = options.trusts_signs = needs.takes_jumps;
  options.selection = std::move(selection);
  options.selection.keeps_params = true;
  DiagnosticSink first_sink;  // the second compilation reports the same again
  const std::optional<Compiled> first = compile(source, options, first_sink);
  options.runs = any_number_of_runs;
  options.adjoint = first && first->problem && first->problem->task;
  options.tangent = options.second = options.adjoint && needs.second_order;
  options.backend = backend;
  std::optional<Compiled> compiled = compile(source, options, sink);
  if (compiled) warn_of_jumps_left_out(*compiled, sink);
  if (compiled) warn_of_unwatched(*compiled, sink);
  if (!compiled || compiled->problem) return compiled;
  sink.report("nothing-to-do", {}, {"there is no scene to run"}, "write scene NAME : PROGRAM { ... }");
  return std::nullopt;
}

struct SceneTable::Storage {
  Storage(std::shared_ptr<const Compiled> from, const SceneTableOptions& wanted)
      : compiled(std::move(from)), options(wanted), run_steps(options.steps.value_or(compiled->problem->steps)) {}
  const char* text(const std::string& s) { return strings.emplace_back(s).c_str(); }
  const dpde_program* program_of(const std::string& name) const {
    return programs != nullptr ? programs->find(name) : compiled->program(name);
  }
  const dpde_program* adjoint_of(const std::string& name) const {
    const auto found = compiled->derived.find(name);
    if (found == compiled->derived.end() || !found->second.adjoint) return nullptr;
    return program_of(found->second.adjoint->program);
  }
  const double* centres_of(const model::Axis& axis);
  dpde_instants instants(const model::When& when);
  void add_coefficient(const model::Coefficient& coefficient);
  void add_task(const model::Task& task);
  void add_unknown(const model::Unknown& unknown);
  std::string why_no_second(const model::Task& task) const;
  void add_second(const model::Task& task);
  dpde_second second_of(const std::string& program) const;
  void add_step();
  void add_parts();
  void add_facts();
  void add_outputs();
  void fill();

  std::shared_ptr<const Compiled> compiled;
  const codegen::ProgramTables* programs = nullptr;  // null: those of the code
  SceneTableOptions options;
  int run_steps;
  std::deque<std::string> strings;
  std::deque<std::vector<int32_t>> steps;
  std::deque<std::vector<double>> centres;
  std::vector<dpde_value> params;
  std::vector<dpde_control> controls;
  std::vector<dpde_source> states;
  std::vector<dpde_coefficient> coefficients;
  std::vector<dpde_noise> noises;
  std::vector<const char*> sought;
  struct Networks {
    std::deque<codegen::NetworkTable> tables;
    std::vector<const dpde_network*> all;
    files::NetworkWeights given;
    std::vector<const double*> weights;  // one for each network; null: from its seed
  };
  Networks networks;
  std::vector<dpde_datum> data;
  std::vector<dpde_loss> losses;
  std::vector<dpde_unknown> unknowns;
  /// Facts about the scene that a run does not need.
  struct Facts {
    std::vector<dpde_put_in> put_in;
    std::vector<dpde_unit> units;
    std::vector<dpde_watched> watched;
    std::vector<dpde_output> outputs;
    std::vector<dpde_adjoint_variant> adjoint_variants;
  };
  Facts facts;
  dpde_scene scene{};
};

const double* SceneTable::Storage::centres_of(const model::Axis& axis) {
  const bool is_fixed = axis.stretch || axis.runs_down() || compiled->problem->metric;  // these centres are valid for
                                                                                        // this cell count only
  if (!is_fixed) return nullptr;
  std::vector<double>& places = centres.emplace_back();
  for (int i = 0; i < axis.cells; ++i) places.push_back(axis.centre(i));
  return places.data();
}

dpde_instants SceneTable::Storage::instants(const model::When& when) {
  if (when.kind == model::When::Kind::over) return {-1, nullptr};
  std::vector<int> at = steps_of(when, *compiled->problem, run_steps);
  if (options.every > 0) std::erase_if(at, [&](int step) { return step % options.every != 0; });
  const std::vector<int32_t>& list = steps.emplace_back(at.begin(), at.end());
  return {static_cast<int32_t>(list.size()), list.data()};
}

/// An unknown control field starts where its task does.
void SceneTable::Storage::add_coefficient(const model::Coefficient& coefficient) {
  const model::Problem& problem = *compiled->problem;
  if (!coefficient.is_control()) {
    coefficients.push_back({text(coefficient.name), coefficient.value.formula.has_value(), 0, 1, nullptr});
    return;
  }
  const model::Source* from = &coefficient.value;
  std::string program = compiled->names.controls.at(coefficient.name);
  const model::Unknown* unknown = problem.find_unknown(coefficient);
  if (unknown != nullptr && !options.begins_as_scene) {
    program = compiled->names.control_starts.at(coefficient.name);
    from = &unknown->from;
  }
  coefficients.push_back({text(coefficient.name), from->formula.has_value(), coefficient.every,
                          problem.intervals(coefficient.every), from->formula ? program_of(program) : nullptr});
}

void SceneTable::Storage::add_unknown(const model::Unknown& unknown) {
  const bool is_elsewhere = !options.begins_as_scene;
  int32_t start = DPDE_START_SCENE;
  const model::Coefficient* coefficient = compiled->problem->find_coefficient(unknown.name);
  const bool is_control_field =
      unknown.kind == model::Unknown::Kind::coefficient && coefficient != nullptr && coefficient->is_control();
  if (is_elsewhere && unknown.is_field() && unknown.from.formula && !is_control_field) start = DPDE_START_FORMULA;
  if (is_elsewhere && unknown.is_field() && !unknown.from.file.empty()) start = DPDE_START_HOST;
  if (start == DPDE_START_FORMULA && program_of(compiled->names.start) == nullptr) start = DPDE_START_SCENE;
  int32_t kind = DPDE_UNKNOWN_PARAM;
  switch (unknown.kind) {
    case model::Unknown::Kind::parameter: break;
    case model::Unknown::Kind::control: kind = DPDE_UNKNOWN_CONTROL; break;
    case model::Unknown::Kind::network: kind = DPDE_UNKNOWN_NETWORK; break;
    case model::Unknown::Kind::initial: kind = DPDE_UNKNOWN_INITIAL; break;
    case model::Unknown::Kind::coefficient: kind = DPDE_UNKNOWN_COEFFICIENT; break;
  }
  unknowns.push_back({text(unknown.name), kind, start, unknown.low, unknown.high});
  if (!is_elsewhere || unknown.is_field() || !unknown.from.formula) return;
  const model::Number* from = as<model::Number>(*unknown.from.formula);
  for (dpde_value& param : params) {
    if (from != nullptr && param.name == unknown.name) param.value = from->value;
  }
}

/// Why there are no second derivatives; "" if there are. A program that no unknown affects has none and needs none.
std::string SceneTable::Storage::why_no_second(const model::Task& task) const {
  if (!compiled->options.tangent &&
      std::ranges::none_of(compiled->derived, [](const auto& each) { return each.second.tangent.has_value(); })) {
    return fmt::format(
        "task {} was compiled without second derivatives: HostOptions::second_order, dpde build --second-order",
        task.name);
  }
  for (const auto& [name, derived] : compiled->derived) {
    if (!derived.second) return fmt::format("task {}: program {} has no second derivatives", task.name, name);
  }
  return "";
}

/// The tangent and its adjoint, as far as they exist.
dpde_second SceneTable::Storage::second_of(const std::string& program) const {
  const auto found = compiled->derived.find(program);
  if (found == compiled->derived.end()) return {};
  const Derived& derived = found->second;
  return {derived.tangent ? program_of(derived.tangent->program) : nullptr,
          derived.second ? program_of(derived.second->program) : nullptr};
}

void SceneTable::Storage::add_second(const model::Task& task) {
  const std::string why = why_no_second(task);
  scene.no_second = why.empty() ? nullptr : text(why);
  scene.second = second_of(compiled->step_name());
  scene.coefficient_second = second_of(compiled->formula_programs()[0]);
  scene.initial_second = second_of(compiled->formula_programs()[1]);
  for (std::size_t i = 0; i < losses.size(); ++i) {
    const std::string& name = compiled->names.losses[i];
    const auto found = compiled->derived.find(name);
    if (found == compiled->derived.end()) continue;  // does not depend on unknowns
    const Derived& loss = found->second;
    losses[i].full = second_of(name);
    if (!loss.gauss_newton || !loss.gauss_newton_adjoint) continue;
    losses[i].gauss_newton = {program_of(loss.gauss_newton->program), program_of(loss.gauss_newton_adjoint->program)};
  }
}

void SceneTable::Storage::add_task(const model::Task& task) {
  scene.task = text(task.name);
  if (!options.begins_as_scene) scene.start = program_of(compiled->names.start);
  const auto is_read = [&](const std::string& name) {
    for (std::size_t i = 0; i < task.losses.size(); ++i) {
      const dpde_program* loss = program_of(compiled->names.losses[i]);
      const char* const* end = loss->fields + loss->field_count;
      if (std::find_if(loss->fields, end, [&](const char* field) { return name == field; }) != end) return true;
    }
    return false;
  };
  for (const model::Datum& datum : task.data) {
    if (!is_read(datum.name)) continue;  // used only by the task's tests
    dpde_instants at = instants(datum.when);
    if (at.count == 1) at = {0, nullptr};
    data.push_back({text(datum.name), at, datum.series ? 1 : 0});
  }
  for (std::size_t i = 0; i < task.losses.size(); ++i) {
    const std::string& name = compiled->names.losses[i];
    const model::Loss& loss = task.losses[i];
    losses.push_back({program_of(name),
                      adjoint_of(name),
                      loss.of_averages ? dpde_instants{} : instants(loss.when),
                      {},
                      {},
                      loss.average.empty() ? nullptr : text(loss.average),
                      loss.of_averages ? 1 : 0,
                      1});
  }
  for (const model::Unknown::Kind kind : order_of_unknowns) {
    for (const model::Unknown& unknown : task.unknowns) {
      if (unknown.kind == kind) add_unknown(unknown);
    }
  }
  scene.optimiser = optimiser_of(task.optimiser.value_or(model::Optimiser{}));
  add_second(task);
}

void SceneTable::Storage::add_step() {
  scene.program = program_of(compiled->step_name());
  scene.adjoint = adjoint_of(compiled->step_name());
  for (const AdjointVariant& variant : compiled->variants) {
    facts.adjoint_variants.push_back({program_of(variant.adjoint), program_of(variant.step)});
    require(facts.adjoint_variants.back().adjoint != nullptr, "a variant has its adjoint");
    require(variant.step.empty() || facts.adjoint_variants.back().step != nullptr, "a variant has its step");
  }
  scene.adjoint_variant_count = static_cast<int32_t>(facts.adjoint_variants.size());
  scene.adjoint_variants = facts.adjoint_variants.data();
}

/// Substeps of steps.
void SceneTable::Storage::add_parts() {
  const model::Problem& problem = *compiled->problem;
  scene.rate = program_of(compiled->names.rate);
  scene.courant = problem.substeps.courant;
  scene.rate_field = scene.rate == nullptr ? nullptr : text(compiled->names.rate_field);
  scene.trial = program_of(compiled->names.trial);
  if (problem.substeps.control)
    scene.control = {problem.scheme.time->order_of_estimate, problem.substeps.control->first};
}

void SceneTable::Storage::add_facts() {
  for (const auto& [name, in] : compiled->problem->remarks.put_in) facts.put_in.push_back({text(name), text(in)});
  for (const auto& [name, unit] : compiled->problem->remarks.units) facts.units.push_back({text(name), text(unit)});
  for (const Watched& one : compiled->watched)
    facts.watched.push_back({text(one.field), one.below.empty() ? nullptr : text(one.below),
                             one.above.empty() ? nullptr : text(one.above), text(one.text), text(one.help),
                             one.is_switch ? 1 : 0, one.begins_with_one_sign ? 1 : 0, one.loss});
  scene.watched = program_of(compiled->names.watched);
  scene.watched_step = program_of(compiled->names.watched_step);
  scene.watched_count = static_cast<int32_t>(facts.watched.size());
  scene.watched_values = facts.watched.data();
  scene.put_in_count = static_cast<int32_t>(facts.put_in.size());
  scene.put_in = facts.put_in.data();
  scene.unit_count = static_cast<int32_t>(facts.units.size());
  scene.units = facts.units.data();
  add_outputs();
}

void SceneTable::Storage::add_outputs() {
  scene.output_program = program_of(compiled->names.shown);
  if (scene.output_program == nullptr) return;
  // The program stores one field for each, in order.
  auto kept = compiled->stencil.find_program(compiled->names.shown)->keeps.begin();
  for (const model::OutputField& shown : compiled->problem->shown)
    facts.outputs.push_back({text(shown.name), text(*kept++)});
  scene.output_count = static_cast<int32_t>(facts.outputs.size());
  scene.outputs = facts.outputs.data();
}

void SceneTable::Storage::fill() {
  const model::Problem& problem = *compiled->problem;
  scene.version = DPDE_SCENE_VERSION;
  scene.name = text(problem.scene);
  scene.rank = static_cast<int32_t>(problem.axes.size());
  for (std::size_t a = 0; a < problem.axes.size(); ++a) {
    const model::Axis& axis = problem.axes[a];
    scene.axes[a] = {text(axis.name), axis.low, axis.high, axis.cells, axis.topology == Topology::periodic,
                     centres_of(axis)};
  }
  scene.t_begin = problem.t_begin;
  scene.step = problem.step;
  scene.steps = run_steps;
  scene.steady = options.steps ? 0 : problem.steady;
  for (const model::Parameter& param : problem.params)
    params.push_back({text(param.name), param.value, param.is_fixed && !options.sets_all ? 1 : 0});
  for (const model::Control& c : problem.controls) {  // a task begins with `start`
    const std::vector<double>& values = c.start.empty() || options.begins_as_scene ? c.values : c.start;
    controls.push_back({text(c.name), c.every, static_cast<int32_t>(values.size()), values.data()});
  }
  for (const model::State& state : problem.states)
    states.push_back({text(state.name), state.initial.formula.has_value()});
  for (const model::Coefficient& c : problem.coefficients) add_coefficient(c);
  for (const network::Network& network : problem.networks) {
    networks.all.push_back(networks.tables.emplace_back(network).get());
    const auto given = networks.given.find(network.name);
    networks.weights.push_back(given == networks.given.end() ? nullptr : given->second.data());
  }
  for (const std::uint64_t seed : problem.noises()) noises.push_back({text(model::noise_name(seed)), seed});
  for (const model::Coefficient& c : problem.coefficients) {
    if (compiled->activity.fields.contains(c.name)) sought.push_back(text(c.name));
  }
  add_facts();
  const std::string &initial = compiled->names.initial, &formulas = compiled->names.coefficients;
  add_step();
  add_parts();
  scene.initial = program_of(initial);
  scene.initial_adjoint = adjoint_of(initial);
  scene.coefficient_formulas = program_of(formulas);
  scene.coefficient_adjoint = adjoint_of(formulas);
  scene.observe = program_of(compiled->names.observe);
  if (problem.task) add_task(*problem.task);
  const auto set = [](int32_t& count, auto& pointer, const auto& items) {
    count = static_cast<int32_t>(items.size());
    pointer = items.data();
  };
  set(scene.param_count, scene.params, params);
  set(scene.control_count, scene.controls, controls);
  set(scene.state_count, scene.states, states);
  set(scene.coefficient_count, scene.coefficients, coefficients);
  set(scene.noise_count, scene.noises, noises);
  set(scene.network_count, scene.networks, networks.all);
  scene.weights = networks.weights.data();
  set(scene.sought_count, scene.sought, sought);
  set(scene.datum_count, scene.data, data);
  set(scene.loss_count, scene.losses, losses);
  set(scene.unknown_count, scene.unknowns, unknowns);
}

SceneTable::SceneTable() = default;
SceneTable::~SceneTable() = default;
const dpde_scene& SceneTable::scene() const { return storage_->scene; }

std::shared_ptr<const SceneTable> SceneTable::make(std::shared_ptr<const Compiled> compiled, const SourceFile& source,
                                                   const SceneTableOptions& options, DiagnosticSink& sink) {
  const std::optional<model::Task>& task = compiled->problem->task;
  if (task && task->losses.empty() && !options.begins_as_scene && compiled->options.selection.beside.empty())
    sink.report("nothing-to-do", {}, {fmt::format("task {} has nothing to minimise", task->name)});
  std::optional<files::NetworkWeights> weights =
      options.without_files ? files::NetworkWeights{} : files::load_weights(*compiled->problem, source, sink);
  if (sink.has_errors() || !weights) return nullptr;
  std::shared_ptr<SceneTable> table(new SceneTable);
  table->storage_ = std::make_unique<Storage>(std::move(compiled), options);
  table->storage_->networks.given = std::move(*weights);
  table->storage_->fill();
  return table;
}

std::shared_ptr<const SceneTable> SceneTable::without_code(const Compiled& compiled,
                                                           const codegen::ProgramTables& programs) {
  std::shared_ptr<SceneTable> table(new SceneTable);
  const std::shared_ptr<const Compiled> not_owned(std::shared_ptr<void>(), &compiled);
  table->storage_ = std::make_unique<Storage>(not_owned, SceneTableOptions{.begins_as_scene = true});
  table->storage_->programs = &programs;
  table->storage_->fill();
  return table;
}

}  // namespace dpde::driver
