// SPDX-License-Identifier: Apache-2.0
#include "report/scene/scene.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "analysis/run/conserved_sums.h"
#include "analysis/unused.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/unsolved.h"
#include "driver/memory/cost.h"
#include "driver/memory/memory_plan.h"
#include "driver/memory/storage.h"
#include "model/analyse/solves.h"
#include "model/scheme.h"
#include "report/scene/advective_form.h"
#include "report/scene/formal_order.h"
#include "report/scene/solves.h"
#include "report/scene/step_character.h"
#include "report/scene/verdict.h"
#include "stability/equations.h"
#include "stability/frozen/zero_step.h"
#include "stability/report/ill_posed.h"
#include "support/names/number_text.h"

namespace dpde::report {

namespace {

Json types_of(const model::Problem& problem) {
  Json types = Json::object();
  for (const model::State& state : problem.states) types[state.name] = "state";
  for (const model::Coefficient& coefficient : problem.coefficients)
    types[coefficient.name] = coefficient.is_control() ? "control field" : "coefficient";
  for (const model::Parameter& param : problem.params)
    types[param.name] = param.unknown ? "unknown parameter" : "parameter";
  return types;
}

/// Text about axes, cells and steps.
std::string grid_text(const model::Problem& problem) {
  std::string text = fmt::format("scene {}:", problem.scene);
  for (const model::Axis& axis : problem.axes) {
    text += fmt::format(" {} = {:.7g} .. {:.7g}{} in {} {}{} cells,", axis.name, axis.low, axis.high,
                        behind_number(problem.unit_of(axis.name)), axis.cells,
                        axis.topology == Topology::periodic ? "periodic" : "bounded",
                        axis.stretch       ? " stretched"
                        : axis.runs_down() ? " (from high to low)"
                                           : "");
  }
  if (problem.metric) text += fmt::format(" {},", problem.metric->name);
  return text +
         fmt::format(" {} steps of {:.7g}{}\n", problem.steps, problem.step, behind_number(problem.unit_of("t")));
}

/// Types of names, and their units if known.
std::string names_text(const model::Problem& problem, const Json& types) {
  std::string text;
  for (const auto& [name, type] : types.items()) {
    const std::string unit = problem.unit_of(name);
    text += fmt::format("  {}: {}{}{}\n", name, type.get<std::string>(), unit.empty() ? "" : " in ", unit);
  }
  for (const auto& [name, unit] : problem.remarks.units) {
    const bool is_axis = std::ranges::find(problem.axes, name, &model::Axis::name) != problem.axes.end();
    if (!is_axis && name != "t" && !types.contains(name)) text += fmt::format("  {}: in {}\n", name, unit);
  }
  return text;
}

Report unused_report(const driver::Compiled& compiled, const SourceFile& source, driver::Session* session) {
  std::string text;
  Json rows = Json::array();
  std::set<std::string> told;
  for (const std::string& dropped : compiled.problem->remarks.dropped) {
    const std::size_t colon = dropped.rfind(": ");
    if (!told.insert(dropped).second || colon == std::string::npos) continue;
    rows.push_back({{"kind", "dropped"},
                    {"name", dropped.substr(0, colon)},
                    {"reason", dropped.substr(colon + 2)},
                    {"place", nullptr}});
  }
  std::vector<analysis::Unused> parts = analysis::unused_parts(compiled);
  std::ranges::move(analysis::idle_precision(compiled, source), std::back_inserter(parts));
  if (session != nullptr) std::ranges::move(analysis::idle_axes(compiled, *session), std::back_inserter(parts));
  for (const analysis::Unused& part : parts) {
    Json place = nullptr;
    std::string line;
    if (part.place.is_known()) {
      const LineColumn at = source.locate(part.place.begin);
      place = {{"line", at.line}, {"column", at.column}};
      line = fmt::format(" (line {})", at.line);
    }
    const std::string kind = analysis::word_of(part.kind);
    rows.push_back({{"kind", kind}, {"name", part.name}, {"reason", part.reason}, {"place", std::move(place)}});
    text += fmt::format("unused {} {}{}: {}\n", kind, part.name, line, part.reason);
  }
  Report report;
  report.json["unused"] = std::move(rows);
  report.add_detail(std::move(text));
  return report;
}

Report conserved_report(const driver::Session& session, const SourceFile& source) {
  Report report;
  Json& result = report.json;
  const std::optional<std::vector<analysis::ConservedSum>> sums =
      analysis::conserved_sums(source, session.shared_compiled());
  if (!sums) return report;
  std::vector<std::string> names, but_for_steps, until_switched;
  for (const analysis::ConservedSum& sum : *sums)
    (sum.but_for_steps ? but_for_steps : sum.until_switched ? until_switched : names).push_back(sum.name);
  result["conserved"] = names;
  result["conserved_but_for_steps"] = but_for_steps;
  result["conserved_until_switched"] = until_switched;
  const bool are_rare = stability::has_rare_events(session.problem());
  result["conserved_between_events"] = are_rare;
  std::string text = fmt::format("conserved{}: {}\n", are_rare ? " but for events" : "",
                                 names.empty() ? "no integral of a field or its square, and no observable"
                                               : fmt::format("{}", fmt::join(names, ", ")));
  if (!names.empty()) {
    report.say(text);
    text.clear();
  }
  if (!but_for_steps.empty())
    text += fmt::format("  and but for what steps in time lose: {}\n", fmt::join(but_for_steps, ", "));
  if (!until_switched.empty())
    text +=
        fmt::format("  and until states come to where something changes them: {}\n", fmt::join(until_switched, ", "));
  report.add_detail(std::move(text));
  return report;
}

/// Reasons why waves grow at every step, or the faster the shorter they are.
std::string causes_text(driver::Session& session, const stability::StabilityReport& verdict, Json& result,
                        DiagnosticSink& sink) {
  result["ill_posed"] = nullptr;
  if (!verdict.is_analysed()) return "";
  // With variable coefficients, growth due to such differences is attributed to the equations.
  if (verdict.limit.kind == stability::StepLimit::Kind::never || verdict.growth_rate > 0) {
    for (const stability::Downwind& found : stability::downwind_differences(session)) {
      sink.report("against-the-wind", found.range,
                  {"the transport of " + found.field, "short waves grow at every step"},
                  stability::downwind_text(found));
    }
  }
  const auto cause = verdict.growth_rate > 0 ? stability::ill_posed(session) : std::nullopt;
  if (!cause) return "";
  result["ill_posed"] = {{"order", cause->order}, {"time", cause->time}};
  const model::State* state = session.problem().find_state(cause->field);
  sink.report("ill-posed-waves", state == nullptr ? SourceRange{} : state->origin.range,
              {stability::ill_posed_text(*cause)}, stability::ill_posed_help());
  return "  ill-posed: " + stability::ill_posed_text(*cause) + "\n";
}

/// `session`: the scene at the start of a run; null if its initial state cannot be computed.
Report step_report(const CheckedScene& scene, const SceneOptions& options, DiagnosticSink& sink) {
  Report report;
  Json& result = report.json;
  result["stability"] = {{"max_step", nullptr}, {"max_courant", nullptr}, {"mode", nullptr}, {"exact", false}};
  result["conserved"] = nullptr;
  if (scene.session == nullptr) {
    report.say("stability: not analysed, the initial state cannot be made\n");
    return report;
  }
  driver::Session& session = *scene.session;
  const stability::StabilityReport verdict = stability::verdict_of(session, options.look);
  Report step = verdict_report(session.problem(), verdict, scene.source);
  result["stability"] = std::move(step.json);
  std::ranges::move(step.parts, std::back_inserter(report.parts));
  report.add_detail(causes_text(session, verdict, result["stability"], sink));
  result["monotone"] = nullptr;
  result["cell_numbers"] = nullptr;
  if (verdict.is_analysed()) {
    const StepCharacter character = character_of(session, verdict.step);
    warn_of_cell_numbers(session, character, sink);
    result.update(json_of(session, character));
    report.add_detail(text_of(session, character));
  }
  if (options.shows_waves && !verdict.is_analysed()) report.say("waves: not analysed, " + verdict.why + "\n");
  if (options.shows_waves && verdict.is_analysed()) {
    const auto waves = stability::waves_of(session, verdict.worst, verdict.step, verdict.group);
    result["waves"] = json_of(session, waves, verdict.step);
    report.say(text_of(session, waves, verdict.step));
  }
  report.append(conserved_report(session, scene.source));
  return report;
}

/// Reports stability at the task's start, if unknown numbers differ there from the scene's.
std::string stability_of_start_text(const model::Task& task, driver::Session* session, Json& result) {
  if (session == nullptr) return "";
  Workspace& workspace = session->workspace();
  std::map<std::string, double> before;
  for (const model::Unknown& unknown : task.unknowns) {
    const model::Number* number = unknown.from.formula ? as<model::Number>(*unknown.from.formula) : nullptr;
    const auto own = workspace.params().find(unknown.name);
    if (unknown.kind != model::Unknown::Kind::parameter || number == nullptr || number->value == own->second) continue;
    before[unknown.name] = own->second;
    workspace.set_param(unknown.name, number->value);
  }
  if (before.empty()) return "";
  const stability::StabilityReport verdict = stability::verdict_of(*session);
  const double limit = verdict.bounded_step();
  std::string text;
  if (verdict.is_analysed() && std::isfinite(limit)) {
    result["stability"]["max_step_where_task_begins"] = limit;
    const std::string found = limit > 0 ? fmt::format("stable up to a step of {:.6g}, the scene's is {:.3g} times that",
                                                      limit, verdict.step / limit)
                                        : std::string("unstable at every step");
    text = fmt::format("  where task {} begins: {}\n", task.name, found);
  }
  for (const auto& [name, value] : before) workspace.set_param(name, value);
  return text;
}

/// Reports a failing solve as a run would, of which this is the first step. Errors in initial observables have no time
/// and no step.
void report_first_step(const Unsolved& error, const driver::Session& session, DiagnosticSink& sink) {
  UnsolvedFacts facts = error.facts();
  const bool is_of_step = !std::isnan(facts.t);
  facts.t = NAN;
  Unsolved of_run(std::move(facts));
  if (is_of_step) of_run.set_place(1, session.steps(), session.problem().t_begin);
  driver::report_error(of_run, sink, driver::place_of_solve(session.compiled(), error.solve_for()));
}

/// Report on solves from the initial observables and one step, after which the operators are known. On a large grid
/// that would take as long as a run; a coarser grid shows the same methods. Implicit schemes without other solves
/// report failures only, which a coarser grid does not show.
Report first_solves_report(driver::Session* session, const SourceFile& source, DiagnosticSink& sink) {
  Report report;
  if (session == nullptr) return report;
  const bool has_solves = !model::solves_of(session->problem()).empty();
  const stability::CoarseGrid grid = stability::grid_of_solutions(*session);
  if (!has_solves && !(grid.is_own() && model::is_implicit(session->problem().scheme.time))) return report;
  if (!grid.is_own()) {
    driver::SessionOptions options = session->options();
    options.cells = grid.cells();
    DiagnosticSink silent;
    const auto coarse = driver::Session::open(source, session->shared_compiled(), options, silent);
    if (coarse == nullptr) {
      const std::string why = silent.all().empty() ? "" : ": " + silent.all().front().message;
      report.say(fmt::format("solves: not looked at, no scene on {}{}\n", grid.text(), why));
      return report;
    }
    report.say(fmt::format("by a step on {}:\n", grid.text()));
    DiagnosticSink found;  // diagnostics for cells that are not the scene's
    report.append(first_solves_report(coarse.get(), source, found));
    for (const Diagnostic& diagnostic : found.all())
      report.say(
          fmt::format("solves: {}{}\n", diagnostic.message, diagnostic.hint.empty() ? "" : "; " + diagnostic.hint));
    if (report.json.contains("solves")) report.json["solves_cells"] = grid.cells();
    return report;
  }
  RolloutSetup setup = session->setup();
  setup.steps = 1;
  setup.steady = 0;
  Rollout one(std::move(setup));
  session->engine().begin_other(one);
  const auto observe_start = [&](const Snapshot& snapshot) {
    if (snapshot.step > 0) return;
    session->observe(snapshot.t, snapshot.states);
    try {
      session->shown(snapshot.t, snapshot.states);
    } catch (const Unsolved& error) {
      report.say(fmt::format("with --out: {}\n", error.what()));
    }
  };
  try {
    one.run({1, observe_start});
  } catch (const Unsolved& error) {
    report_first_step(error, *session, sink);
    return report;
  } catch (const Error& error) {
    report.say(fmt::format("solves: {}\n", error.what()));
    return report;
  }
  if (!has_solves) return report;
  const auto solves = driver::solves_of(session->compiled(), one.solve_notes());
  report.json["solves"] = json_of(solves);
  report.say(driver::text_of(solves, driver::SolveTimes::left_out));
  report.add_detail(driver::times_text(solves));
  return report;
}

}  // namespace

Report scene_report(CheckedScene scene, const SceneOptions& options, DiagnosticSink& sink) {
  const driver::Compiled& compiled = scene.compiled;
  const model::Problem& problem = *compiled.problem;
  const driver::Memory memory = driver::memory_of(compiled);
  Report report;
  Json& result = report.json;
  result["scene"] = problem.scene;
  result["types"] = types_of(problem);
  if (!problem.remarks.units.empty()) result["units"] = problem.remarks.units;
  report.say(grid_text(problem));
  report.add_detail(names_text(problem, result["types"]));
  const std::vector<driver::Jump> jumps =
      scene.session == nullptr ? std::vector<driver::Jump>{} : driver::jumps_in_fluxes(*scene.session);
  const FormalOrder order = formal_order(problem, jumps);
  result.update(json_of(order));
  report.say(text_of(order));
  report.add_detail(text_of_operators(order));
  warn_of_jumps(jumps, sink);
  const std::vector<std::string> velocities = advective_velocities(problem);
  result["advective_form"] = velocities;
  report.add_detail(flux_form_text(velocities));
  report.append(step_report(scene, options, sink));
  if (problem.task) report.say(stability_of_start_text(*problem.task, scene.session.get(), result));
  report.append(first_solves_report(scene.session.get(), scene.source, sink));
  const Report unused = unused_report(compiled, scene.source, scene.session.get());
  scene.session.reset();
  report.append(networks_report(problem));
  double cells = 1;
  for (const model::Axis& axis : problem.axes) cells *= axis.cells;
  report.append(cost_report(compiled, cells, options.gradient.threads, options.measures_machine));
  report.append(whole_grid_report(compiled));
  result["memory_bytes"] = memory.run;
  result["output_memory_bytes"] = driver::bytes_of_outputs(compiled);
  report.say(fmt::format("memory: {} for a run ({} more with --out)", human_bytes(memory.run),
                         human_bytes(driver::bytes_of_outputs(compiled))));
  if (problem.task) report.append(gradient_memory_report(compiled, scene.source, options.gradient));
  report.say("\n");
  result["dropped"] = problem.remarks.dropped;
  std::set<std::string> told;  // a function may be inlined several times
  for (const std::string& dropped : problem.remarks.dropped) {
    if (told.insert(dropped).second) report.add_detail(fmt::format("dropped: {}\n", dropped));
  }
  report.append(unused);
  report.append(savings_report(compiled, scene.source));
  return report;
}

}  // namespace dpde::report
