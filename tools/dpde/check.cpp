// SPDX-License-Identifier: Apache-2.0
// dpde check: parses, types, and says what a scene will cost before it runs.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "analysis/conserved_sums.h"
#include "analysis/unused.h"
#include "character_report.h"
#include "command.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/unsolved.h"
#include "driver/cost.h"
#include "driver/data.h"
#include "driver/machine_speed.h"
#include "driver/memory_plan.h"
#include "driver/savings.h"
#include "driver/storage.h"
#include "driver/switches.h"
#include "driver/whole_grid_cost.h"
#include "flux_form.h"
#include "model/build.h"
#include "model/chart.h"
#include "model/solves.h"
#include "order_report.h"
#include "preparing.h"
#include "progress.h"
#include "scene_output.h"
#include "scene_session.h"
#include "stability/equations.h"
#include "stability/ill_posed.h"
#include "stability/local_character.h"
#include "stability_report.h"
#include "support/number_text.h"
#include "task_run.h"
#include "training/beside.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

struct CheckOptions : TaskOptions {
  bool waves = false, all_cells = false, measure = false;
};

std::string report_networks(const model::Problem& problem, Json& result) {
  std::string text;
  for (const network::Network& network : problem.networks) {
    const std::int64_t weights = weight_count(network);
    const double products = multiplications_a_cell(network);
    result["networks"][network.name] = {
        {"weights", weights}, {"multiplications_per_point", products}, {"real", name_of(network.real)}};
    text += fmt::format("network {}: {} weights, ", network.name, weights);
    text += network.is_host() ? std::string("computed by the host\n")
                              : fmt::format("{:.6g} multiplications a cell in {}\n", products, name_of(network.real));
  }
  return text;
}

Json types_of(const model::Problem& problem) {
  Json types = Json::object();
  for (const model::State& state : problem.states) types[state.name] = "state";
  for (const model::Coefficient& coefficient : problem.coefficients)
    types[coefficient.name] = coefficient.is_control() ? "control field" : "coefficient";
  for (const model::Parameter& param : problem.params)
    types[param.name] = param.unknown ? "unknown parameter" : "parameter";
  return types;
}

Json cost_json(const driver::Cost& cost, const driver::MachineSpeed& speed) {
  return {{"bytes_per_point", cost.bytes},
          {"flops_per_point", cost.flops},
          {"roofline_points_per_s", json_number(speed.points(cost.bytes, cost.flops))}};
}

/// What the machine allows, as it was measured in an undisturbed moment.
std::string report_cost(Job& job, const CheckOptions& options, const driver::Compiled& compiled, double cells,
                        Json& result) {
  const driver::Cost cost = driver::cost_of(compiled.loop, compiled.step_name());
  const driver::MachineSpeed speed = driver::machine_speed(compiled.options.cache.get(), cost.bytes * cells,
                                                           thread_count(job.options()), options.measure);
  result["cost"] = cost_json(cost, speed);
  result["machine"] = {{"copy_bytes_per_s", speed.copy}, {"flops_per_s", speed.flops},
                       {"measured", speed.date},         {"busy", speed.is_busy},
                       {"load_per_core", speed.load},    {"from_cache", speed.from_cache}};
  result["machine_busy"] = speed.is_busy;
  const auto adjoint = compiled.derived.find(compiled.step_name());
  if (compiled.problem->task && adjoint != compiled.derived.end() && adjoint->second.adjoint)
    result["adjoint_cost"] = cost_json(driver::cost_of(compiled.loop, adjoint->second.adjoint->program), speed);
  const double rate = speed.points(cost.bytes, cost.flops);
  if (!std::isfinite(rate)) return "a step moves and computes nothing\n";
  const bool is_of_memory = cost.bytes > 0 && rate == speed.copy / cost.bytes;
  return fmt::format("a step moves {} bytes and takes {} flops a cell; {} allows {} points/s here (measured {}{})\n",
                     cost.bytes, cost.flops, is_of_memory ? "memory" : "arithmetic", human_count(rate), speed.date,
                     speed.is_busy ? fmt::format(", on a busy machine: load {:.1f} a core", speed.load) : "");
}

/// Transforms and solves of a step go over the whole grid; the bytes of the first are in those of a run.
std::string report_whole_grid(const driver::Compiled& compiled, Json& result) {
  std::string text;
  const auto add = [&](const char* key, const driver::WholeGridCost& cost, const char* kind) {
    result[key] = nullptr;
    if (cost.flops == 0) return;
    result[key] = {{"bytes", cost.bytes}, {"flops_per_step", cost.flops}, {"estimate", kind[0] != 0}};
    text +=
        fmt::format("{} of a step: {} and {} flops{}\n", key, human_bytes(cost.bytes), human_count(cost.flops), kind);
  };
  add("transforms", driver::cost_of_transforms(compiled, compiled.step_name()), "");
  add("solves", driver::cost_of_solves(compiled, compiled.step_name()), ", an estimate: the method shows in the run");
  return text;
}

/// What dropping terms and leaving out derivatives that nobody asks for saves, against the scene with all of them.
std::string report_savings(const Job& job, const driver::Compiled& compiled, Json& result) {
  const std::optional<driver::Traffic> full = driver::traffic_in_full(job.source(), compiled);
  const driver::Traffic used = driver::traffic_of(compiled);
  std::string text;
  Json saved = Json::object();
  const auto add = [&](const char* key, const char* what, std::optional<double> without, std::optional<double> with) {
    const bool is_known = without && with;
    saved[key] = is_known ? Json(*without - *with) : Json(nullptr);
    if (is_known && *without > *with)
      text +=
          fmt::format("{} {} of {} bytes {}", text.empty() ? "saved a cell:" : ",", *without - *with, *without, what);
  };
  add("step_bytes_per_point", "of a step", full ? std::optional(full->step) : std::nullopt, used.step);
  if (compiled.problem->task) {
    add("adjoint_bytes_per_point", "of an adjoint step", full ? full->adjoint : std::nullopt, used.adjoint);
    add("stored_bytes_per_point", "of each state that a gradient stores", full ? full->stored : std::nullopt,
        used.stored);
  }
  result["saved"] = std::move(saved);
  return text.empty() ? "" : text + "\n";
}

/// What the scene and its task do not use; what the model level has dropped comes first.
std::string report_unused(const SourceFile& source, const driver::Compiled& compiled, driver::Session* session,
                          Json& result) {
  std::string text;
  Json rows = Json::array();
  std::set<std::string> told;
  for (const std::string& dropped : compiled.problem->dropped) {
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
  result["unused"] = std::move(rows);
  return text;
}

/// The states that a gradient stores, by the plan of the run itself.
std::string report_gradient(Job& job, const TaskOptions& options, const driver::Compiled& compiled, Json& result) {
  const driver::Memory memory = driver::memory_of(compiled);
  const auto bytes = checkpoint_bytes(job, options);
  if (!bytes) return "";
  const std::optional<GradientPlan> plan =
      driver::plan_of_gradient(compiled, {thread_count(options), *bytes, options.checkpoint_folder});
  result["gradient_memory_bytes_per_part"] = memory.part;
  const double stored = plan ? memory.gradient + static_cast<double>(plan->checkpoint_bytes + plan->tape_bytes) : 0;
  result["gradient_memory_bytes"] = plan ? Json(stored) : Json(nullptr);
  result["checkpoints"] = nullptr;
  result["gradient_peak_bytes"] = nullptr;
  if (!plan) return "";
  const double peak = driver::peak_of_gradient(compiled, *plan, job.source());
  result["gradient_peak_bytes"] = peak;
  result["checkpoints"] = {{"stored", plan->stored_states},
                           {"recomputed_steps", plan->recomputed_steps},
                           {"bytes", plan->checkpoint_bytes},
                           {"block_steps", plan->block_steps},
                           {"tape_bytes", plan->tape_bytes}};
  std::string stores = "stores none";
  if (plan->stores_states)
    stores = plan->recomputed_steps == 0
                 ? "stores every step"
                 : fmt::format("stores {} state{} and makes {} steps again", plan->stored_states,
                               plan->stored_states == 1 ? "" : "s", plan->recomputed_steps);
  if (plan->block_steps > 1) stores += fmt::format(" ({} steps at once)", plan->block_steps);
  std::string text = fmt::format(", and {} for a gradient that {}", human_bytes(peak), stores);
  if (plan->stores_states) text += fmt::format(": {}", human_bytes(stored));
  if (plan->tape_bytes > 0)
    text += fmt::format(" and keeps {} of what networks and solves find",
                        human_bytes(static_cast<double>(plan->tape_bytes)));
  if (!options.checkpoint_folder.empty()) text += " in a file";
  if (memory.part > 0)
    text += fmt::format(", with {} more for each part of the step that is split into most", human_bytes(memory.part));
  return text;
}

std::string report_conserved(Job& job, const driver::Session& session, Json& result) {
  const std::optional<std::vector<analysis::ConservedSum>> sums =
      analysis::conserved_sums(job.source(), session.shared_compiled());
  if (!sums) return "";
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
  if (!but_for_steps.empty())
    text += fmt::format("  and but for what steps in time lose: {}\n", fmt::join(but_for_steps, ", "));
  if (!until_switched.empty())
    text +=
        fmt::format("  and until states come to where something changes them: {}\n", fmt::join(until_switched, ", "));
  return text;
}

/// Why waves grow at every step, or the faster the shorter they are.
std::string report_causes(Job& job, driver::Session& session, const stability::Verdict& verdict, Json& result) {
  result["ill_posed"] = nullptr;
  if (!verdict.is_analysed()) return "";
  // What such differences let grow is counted as growth of the equations where coefficients vary.
  if (verdict.limit.kind == stability::StepLimit::Kind::never || verdict.growth_rate > 0) {
    for (const stability::Downwind& found : stability::downwind_differences(session)) {
      job.sink().report("against-the-wind", found.range,
                        {"the transport of " + found.field, "short waves grow at every step"},
                        stability::downwind_text(found));
    }
  }
  const auto cause = verdict.growth_rate > 0 ? stability::ill_posed(session) : std::nullopt;
  if (!cause) return "";
  result["ill_posed"] = {{"order", cause->order}, {"time", cause->time}};
  const model::State* state = session.problem().find_state(cause->field);
  job.sink().report("ill-posed-waves", state == nullptr ? SourceRange{} : state->origin.range,
                    {stability::ill_posed_text(*cause)}, stability::ill_posed_help());
  return "  ill-posed: " + stability::ill_posed_text(*cause) + "\n";
}

stability::Look look_of(const CheckOptions& options) {
  return {options.all_cells, shown_in_line(options.streams.err, false, options.quiet || options.json)};
}

/// `session`: the scene as a run would begin; null where its initial state cannot be made.
std::string report_stability(Job& job, driver::Session* session, const CheckOptions& options, Json& result) {
  result["stability"] = {{"max_step", nullptr}, {"max_courant", nullptr}, {"mode", nullptr}, {"exact", false}};
  result["conserved"] = nullptr;
  if (session == nullptr) return "stability: not analysed, the initial state cannot be made\n";
  const stability::Verdict verdict = stability::verdict_of(*session, look_of(options));
  StabilityReport report = report_of(session->problem(), verdict, job.source());
  result["stability"] = std::move(report.json);
  std::string text = report.text + report_causes(job, *session, verdict, result["stability"]) +
                     report_character(job, *session, verdict, result);
  if (options.waves) text += report_waves(*session, verdict, result);
  return text + report_conserved(job, *session, result);
}

/// Where numbers that a task seeks begin elsewhere than the scene has them.
std::string report_stability_of_start(const model::Task& task, driver::Session* session, Json& result) {
  if (session == nullptr) return "";
  Workspace& workspace = session->workspace();
  std::map<std::string, double> before;
  for (const model::Unknown& unknown : task.unknowns) {
    const model::Number* number =
        unknown.from.formula ? std::get_if<model::Number>(&(*unknown.from.formula)->kind) : nullptr;
    const auto own = workspace.params().find(unknown.name);
    if (unknown.kind != model::Unknown::Kind::parameter || number == nullptr || number->value == own->second) continue;
    before[unknown.name] = own->second;
    workspace.set_param(unknown.name, number->value);
  }
  if (before.empty()) return "";
  const stability::Verdict verdict = stability::verdict_of(*session);
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

/// By one step from where the scene begins: the operators are known then.
std::string report_solves(driver::Session* session, Json& result) {
  if (session == nullptr || model::solves_of(session->problem()).empty()) return "";
  RolloutSetup setup = session->setup();
  setup.steps = 1;
  setup.steady = 0;
  Rollout one(std::move(setup));
  session->engine().begin_other(one);
  try {
    one.run();
  } catch (const Unsolved& error) {
    const std::string hint = error.hint();
    return fmt::format("solves: {}{}\n", error.what(), hint.empty() ? "" : "; " + hint);
  } catch (const Error& error) {
    return fmt::format("solves: {}\n", error.what());
  }
  const auto solves = driver::solves_of(session->compiled(), one.solve_notes());
  result["solves"] = json_of(solves);
  return driver::text_of(solves);
}

/// The scene as it begins; null where that cannot be made. What is wrong with files was told already.
std::unique_ptr<driver::Session> open_checked(Job& job) {
  DiagnosticSink silent;
  std::unique_ptr<driver::Session> session = open_scene(job, silent);
  for (const Diagnostic& diagnostic : silent.all()) {
    const bool is_told = diagnostic.kind == KindRef("start-not-finite").kind ||
                         diagnostic.kind == KindRef("coefficient-not-finite").kind;
    if (is_told) job.sink().add(diagnostic);
  }
  if (session != nullptr) has_finite_exact(*session, job.sink());
  return session;
}

/// What names are, and their units where they are known.
std::string names_text(const model::Problem& problem, const Json& types) {
  std::string text;
  for (const auto& [name, type] : types.items()) {
    const std::string unit = problem.unit_of(name);
    text += fmt::format("  {}: {}{}{}\n", name, type.get<std::string>(), unit.empty() ? "" : " in ", unit);
  }
  for (const auto& [name, unit] : problem.units) {
    const bool is_axis = std::ranges::find(problem.axes, name, &model::Axis::name) != problem.axes.end();
    if (!is_axis && name != "t" && !types.contains(name)) text += fmt::format("  {}: in {}\n", name, unit);
  }
  return text;
}

void check_scene(Job& job, const CheckOptions& options, const driver::Compiled& compiled, Json& result) {
  const model::Problem& problem = *compiled.problem;
  const driver::Memory memory = driver::memory_of(compiled);
  result["scene"] = problem.scene;
  result["types"] = types_of(problem);
  if (!problem.units.empty()) result["units"] = problem.units;
  std::string text = fmt::format("scene {}:", problem.scene);
  double cells = 1;
  for (const model::Axis& axis : problem.axes) {
    text += fmt::format(" {} = {} .. {}{} in {} {}{} cells,", axis.name, axis.low, axis.high,
                        behind_number(problem.unit_of(axis.name)), axis.cells,
                        axis.topology == Topology::periodic ? "periodic" : "bounded",
                        axis.stretch       ? " stretched"
                        : axis.runs_down() ? " (from high to low)"
                                           : "");
    cells *= axis.cells;
  }
  if (problem.metric) text += fmt::format(" {},", problem.metric->name);
  text += fmt::format(" {} steps of {}{}\n", problem.steps, problem.step, behind_number(problem.unit_of("t")));
  text += names_text(problem, result["types"]);
  const std::unique_ptr<driver::Session> session = open_checked(job);
  const std::vector<driver::Jump> jumps =
      session == nullptr ? std::vector<driver::Jump>{} : driver::jumps_in_fluxes(*session);
  text += report_order(problem, result, jumps);
  warn_of_jumps(job, jumps);
  text += report_flux_form(problem, result);
  text += report_stability(job, session.get(), options, result);
  if (problem.task) text += report_stability_of_start(*problem.task, session.get(), result);
  text += report_solves(session.get(), result);
  text += report_networks(problem, result);
  text += report_cost(job, options, compiled, cells, result);
  text += report_whole_grid(compiled, result);
  result["memory_bytes"] = memory.run;
  result["output_memory_bytes"] = driver::bytes_of_outputs(compiled);
  text += fmt::format("memory for fields: {} for a run ({} more with --out)", human_bytes(memory.run),
                      human_bytes(driver::bytes_of_outputs(compiled)));
  if (problem.task) text += report_gradient(job, options, compiled, result);
  text += "\n";
  result["dropped"] = problem.dropped;
  std::set<std::string> told;  // a function may be put in many times
  for (const std::string& dropped : problem.dropped) {
    if (told.insert(dropped).second) text += fmt::format("dropped: {}\n", dropped);
  }
  text += report_unused(job.source(), compiled, session.get(), result);
  text += report_savings(job, compiled, result);
  job.say(text);
}

void check_programs(Job& job, const driver::Compiled& compiled, Json& result) {
  Json programs = Json::object();
  for (const std::string& name : compiled.primal_programs) {
    const driver::Cost cost = driver::cost_of(compiled.loop, name);
    programs[name] = {{"bytes_per_point", cost.bytes}, {"flops_per_point", cost.flops}};
    job.say(fmt::format("program {}: {} bytes and {} flops a cell\n", name, cost.bytes, cost.flops));
  }
  result["programs"] = std::move(programs);
}

Json check_one(Job& job, const CheckOptions& options) {
  Json result = Json::object();
  std::optional<driver::CompileOptions> compile_options = job.compile_options();
  if (!compile_options) return result;
  compile_options->backend.reset();
  compile_options->verify = true;
  compile_options->adjoint = true;
  compile_options->takes_jumps = true;  // they are told beside all else
  const Preparing preparing(job, "stopped before the check was complete");
  const std::optional<driver::Compiled> compiled = driver::compile(job.source(), *compile_options, job.sink());
  if (!compiled) return result;
  if (compiled->problem) driver::check_files(*compiled->problem, job.source(), job.sink());
  training::check_beside(*compiled, job.source(), job.sink());
  if (compiled->problem) {
    check_scene(job, options, *compiled, result);
  } else {
    check_programs(job, *compiled, result);
  }
  for (const std::string& chart : model::chart_names(compiled->ast))
    model::chart_from_ast(compiled->ast, chart, job.sink());
  driver::report_jumps_left_out(*compiled, job.sink());
  driver::warn_of_watched(*compiled, job.sink());
  return result;
}

int check(const CheckOptions& options) {
  Job job(options);
  Json result = Json::object();
  guarded(job, [&] {
    if (job.load_source()) result = job.of_each_task([&] { return check_one(job, options); });
  });
  if (!result.contains("diagnostics")) result["diagnostics"] = Json::array();
  return job.finish(std::move(result));
}

}  // namespace

void add_check(CLI::App& app, Console& console) {
  const auto options = std::make_shared<CheckOptions>();
  CLI::App* verb = app.add_subcommand("check", "find mistakes; say what a scene costs before it runs");
  add_common_options(*verb, *options, console, {.out = false, .seed = false});
  add_storage_options(*verb, *options);
  verb->add_flag("--waves", options->waves, "how a step damps and delays waves of 4, 8, 16 and 32 cells");
  verb->add_flag("--all-cells", options->all_cells,
                 "look at what products fold back on large grids, too: it may take minutes");
  verb->add_flag("--measure", options->measure, "measure again what this machine can do; else once");
  verb->footer(
      "Examples:\n  dpde check burgers.dpde\n  dpde check burgers.dpde recover --memory 64M\n  dpde check heat.dpde "
      "plate --set cells=1024 --json");
  on_call(*verb, console, [options] { return check(*options); });
}

}  // namespace dpde::tools
