// SPDX-License-Identifier: Apache-2.0
// dpde check: parses, types, and says what a scene will cost before it runs.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <set>

#include "analysis/conserved_sums.h"
#include "command.h"
#include "driver/cost.h"
#include "driver/data.h"
#include "driver/memory_plan.h"
#include "driver/savings.h"
#include "driver/storage.h"
#include "model/build.h"
#include "model/chart.h"
#include "preparing.h"
#include "scene_session.h"
#include "stability_report.h"
#include "stencil/operator_order.h"
#include "task_run.h"
#include "training/beside.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

struct Order {
  int space = 0, time = 0;
};

bool is_transport_alone(const model::Expr& rate) {
  const model::Neg* neg = std::get_if<model::Neg>(&rate->kind);
  return neg && std::holds_alternative<model::Advect>(neg->operand->kind);
}

/// What is left of the order in time by equations with steps of their own: 1 where a slow one reads a faster one, which
/// it sees where the step begins, else 2: the faster ones see the slow on straight lines.
int order_with_parts(const model::Problem& problem, int order) {
  const auto parts_of = [&](const std::string& name) {
    const model::State* read = problem.find_state(name);
    return read == nullptr ? 1 : read->parts;
  };
  const bool has_parts = std::ranges::any_of(problem.states, [](const model::State& state) { return state.parts > 1; });
  for (const model::State& state : problem.states) {
    const bool reads_faster = state.rhs && model::any_part(*state.rhs, [&](const model::Expr& e) {
                                const model::Field* field = std::get_if<model::Field>(&e->kind);
                                return field != nullptr && parts_of(field->name) > state.parts;
                              });
    if (reads_faster) return 1;
  }
  return has_parts ? std::min(order, 2) : order;
}

/// The formal order of the scheme: the lowest of what the equations use; of operators of the file the one that is
/// stated.
Order order_of(const model::Problem& problem) {
  const model::Scheme& scheme = problem.scheme;
  std::vector<int> space;
  bool transports = false, split = false;
  for (const model::State& state : problem.states) {
    if (!state.rhs) continue;
    model::any_part(*state.rhs, [&](const model::Expr& e) {
      if (std::holds_alternative<model::Advect>(e->kind)) {
        space.push_back(scheme.advect_order);
        transports = true;
        split = split || !is_transport_alone(*state.rhs);
      }
      if (const model::Derivative* d = std::get_if<model::Derivative>(&e->kind)) {
        space.push_back(d->order % 2 == 0 ? scheme.laplacian_order : scheme.derivative_order);
      }
      return false;
    });
  }
  for (const model::StatedOrder& stated : problem.operators) {
    if (stated.in_equations) space.push_back(stated.order);
  }
  Order order;
  order.space = space.empty() ? 0 : *std::min_element(space.begin(), space.end());
  switch (scheme.time) {
    case model::TimeScheme::euler: order.time = 1; break;
    case model::TimeScheme::verlet:
    case model::TimeScheme::ab2:
    case model::TimeScheme::leapfrog:
    case model::TimeScheme::rk2: order.time = 2; break;
    case model::TimeScheme::rk4: order.time = 4; break;
    case model::TimeScheme::ssp_rk3: order.time = 3; break;
  }
  order.time = order_with_parts(problem, order.time);
  if (!model::follows_flow(scheme.advect) || !transports) return order;
  const bool is_linear = scheme.advect == model::Advection::semi_lagrangian && scheme.advect_order == 1;
  order.time = split || is_linear ? 1 : 2;
  return order;
}

/// Operators of the file, with their orders as stated and as measured: null where there is no such number, and why.
std::string report_operators(const model::Problem& problem, Json& result) {
  std::string text;
  Json rows = Json::array();
  for (const model::StatedOrder& stated : problem.operators) {
    const stencil::MeasuredOrder found = stencil::measure_order(problem, stated);
    Json row = {{"name", stated.name}, {"stated", stated.order}, {"measured", nullptr}};
    std::string words;
    switch (found.kind) {
      case stencil::MeasuredOrder::Kind::found:
        row["measured"] = found.order;
        words = found.order == stated.order ? " and measured" : fmt::format(", measured {}", found.order);
        break;
      case stencil::MeasuredOrder::Kind::none: words = fmt::format(", but it grows as 1/h^{}", found.order); break;
      case stencil::MeasuredOrder::Kind::exact: words = ", exact for smooth fields"; break;
      case stencil::MeasuredOrder::Kind::unknown: words = fmt::format(", not measured: {}", found.why); break;
    }
    row["note"] = found.kind == stencil::MeasuredOrder::Kind::found ? Json(nullptr) : Json(words.substr(2));
    if (std::ranges::find(rows, row) != rows.end()) continue;
    text += fmt::format("operator {}: order {} as stated{}\n", stated.name, stated.order, words);
    rows.push_back(std::move(row));
  }
  result["operators"] = std::move(rows);
  return text;
}

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

Json cost_json(const driver::Cost& cost, double copy_rate) {
  return {{"bytes_per_point", cost.bytes},
          {"flops_per_point", cost.flops},
          {"roofline_points_per_s", cost.bytes > 0 ? json_number(copy_rate / cost.bytes) : Json(nullptr)}};
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
    text += fmt::format(" and keeps {} of what networks compute", human_bytes(static_cast<double>(plan->tape_bytes)));
  if (!options.checkpoint_folder.empty()) text += " in a file";
  if (memory.part > 0)
    text += fmt::format(", with {} more for each part of the step that is split into most", human_bytes(memory.part));
  return text;
}

std::string report_conserved(Job& job, const driver::Session& session, Json& result) {
  const std::optional<std::vector<std::string>> sums =
      analysis::conserved_sums(job.source(), session.shared_compiled());
  if (!sums) return "";
  result["conserved"] = *sums;
  return fmt::format("conserved: {}\n", sums->empty() ? "no integral of a field or its square, and no observable"
                                                      : fmt::format("{}", fmt::join(*sums, ", ")));
}

/// The scene as a run would begin: its initial state and coefficients are made for that.
std::string report_stability(Job& job, Json& result) {
  result["stability"] = {{"max_step", nullptr}, {"max_courant", nullptr}, {"mode", nullptr}, {"exact", false}};
  result["conserved"] = nullptr;
  DiagnosticSink sink;  // what is wrong with files was told already
  const std::unique_ptr<driver::Session> session = open_scene(job, sink);
  if (session == nullptr) return "stability: not analysed, the initial state cannot be made\n";
  const stability::Verdict verdict = stability::verdict_of(*session);
  StabilityReport report = report_of(session->problem(), verdict, job.source());
  result["stability"] = std::move(report.json);
  return report.text + report_conserved(job, *session, result);
}

void check_scene(Job& job, const TaskOptions& options, const driver::Compiled& compiled, Json& result) {
  const model::Problem& problem = *compiled.problem;
  const driver::Cost cost = driver::cost_of(compiled.loop, compiled.step_name());
  const driver::Memory memory = driver::memory_of(compiled);
  result["scene"] = problem.scene;
  result["types"] = types_of(problem);
  std::string text = fmt::format("scene {}:", problem.scene);
  double cells = 1;
  for (const model::Axis& axis : problem.axes) {
    text += fmt::format(" {} = {} .. {} in {} {}{} cells,", axis.name, axis.low, axis.high, axis.cells,
                        axis.topology == Topology::periodic ? "periodic" : "bounded", axis.stretch ? " stretched" : "");
    cells *= axis.cells;
  }
  text += fmt::format(" {} steps of {}\n", problem.steps, problem.step);
  for (const auto& [name, type] : result["types"].items())
    text += fmt::format("  {}: {}\n", name, type.get<std::string>());
  if (problem.program.empty()) {
    const Order order = order_of(problem);
    result["order"] = {{"space", order.space}, {"time", order.time}};
    text += fmt::format("order: {} in space, {} in time\n", order.space, order.time);
    text += report_operators(problem, result);
  } else {
    result["order"] = {{"space", nullptr}, {"time", nullptr}};
  }
  text += report_stability(job, result);
  text += report_networks(problem, result);
  const driver::CopyRate copy =
      driver::measure_copy(std::clamp(cost.bytes * cells, 32e3, 256e6), thread_count(job.options()));
  const double copy_rate = copy.best;
  result["cost"] = cost_json(cost, copy_rate);
  result["machine_busy"] = copy.is_busy;
  text += fmt::format(
      "a step moves {} bytes and takes {} flops a cell; memory allows {} points/s here (best of several copies{})\n",
      cost.bytes, cost.flops, human_count(copy_rate / std::max(cost.bytes, 1.0)),
      copy.is_busy ? ", on a busy machine" : "");
  result["memory_bytes"] = memory.run;
  result["output_memory_bytes"] = driver::bytes_of_outputs(compiled);
  text += fmt::format("memory for fields: {} for a run ({} more with --out)", human_bytes(memory.run),
                      human_bytes(driver::bytes_of_outputs(compiled)));
  if (problem.task) {
    const auto adjoint = compiled.derived.find(compiled.step_name());
    if (adjoint != compiled.derived.end() && adjoint->second.adjoint) {
      result["adjoint_cost"] = cost_json(driver::cost_of(compiled.loop, adjoint->second.adjoint->program), copy_rate);
    }
    text += report_gradient(job, options, compiled, result);
  }
  text += "\n";
  result["dropped"] = problem.dropped;
  std::set<std::string> told;  // a function may be put in many times
  for (const std::string& dropped : problem.dropped) {
    if (told.insert(dropped).second) text += fmt::format("dropped: {}\n", dropped);
  }
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

int check(const TaskOptions& options) {
  Job job(options);
  Json result = {{"diagnostics", Json::array()}};
  guarded(job, [&] {
    if (!job.load_source()) return;
    std::optional<driver::CompileOptions> compile_options = job.compile_options();
    if (!compile_options) return;
    compile_options->backend.reset();
    compile_options->verify = true;
    compile_options->adjoint = true;
    const Preparing preparing(job, "stopped before the check was complete");
    const std::optional<driver::Compiled> compiled = driver::compile(job.source(), *compile_options, job.sink());
    if (!compiled) return;
    if (compiled->problem) driver::check_files(*compiled->problem, job.source(), job.sink());
    training::check_beside(*compiled, job.source(), job.sink());
    for (const std::string& chart : model::chart_names(compiled->ast))
      model::chart_from_ast(compiled->ast, chart, job.sink());
    if (compiled->problem) {
      check_scene(job, options, *compiled, result);
    } else {
      check_programs(job, *compiled, result);
    }
  });
  return job.finish(std::move(result));
}

}  // namespace

void add_check(CLI::App& app, int& status) {
  const auto options = std::make_shared<TaskOptions>();
  CLI::App* verb = app.add_subcommand("check", "find mistakes; say what a scene costs before it runs");
  add_common_options(*verb, *options, {.out = false, .seed = false});
  add_storage_options(*verb, *options);
  verb->footer(
      "Examples:\n  dpde check burgers.dpde\n  dpde check burgers.dpde recover --memory 64M\n  dpde check heat.dpde "
      "plate --set cells=1024 --json");
  on_call(*verb, status, [options] { return check(*options); });
}

}  // namespace dpde::tools
