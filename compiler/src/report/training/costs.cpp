// SPDX-License-Identifier: Apache-2.0
#include "report/training/costs.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "driver/memory/cost.h"
#include "driver/memory/machine_speed.h"
#include "driver/memory/memory_plan.h"
#include "driver/memory/savings.h"
#include "driver/memory/storage.h"
#include "driver/memory/whole_grid_cost.h"
#include "support/names/number_text.h"

namespace dpde::report {

namespace {

Json cost_json(const driver::Cost& cost, const driver::MachineSpeed& speed) {
  return {{"bytes_per_point", cost.bytes},
          {"flops_per_point", cost.flops},
          {"roofline_points_per_s", json_number(speed.points(cost.bytes, cost.flops))}};
}

}  // namespace

Report networks_report(const model::Problem& problem) {
  Report report;
  Json& result = report.json;
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
  report.say(std::move(text));
  return report;
}

Report cost_report(const driver::Compiled& compiled, double cells, int threads, bool measures_again) {
  Report report;
  Json& result = report.json;
  const driver::Cost cost = driver::cost_of(compiled.loop, compiled.step_name());
  const driver::MachineSpeed speed =
      driver::machine_speed(compiled.options.cache.get(), cost.bytes * cells, threads, measures_again);
  result["cost"] = cost_json(cost, speed);
  result["machine"] = {{"copy_bytes_per_s", speed.copy}, {"flops_per_s", speed.flops},
                       {"measured", speed.date},         {"busy", speed.is_busy},
                       {"load_per_core", speed.load},    {"from_cache", speed.from_cache}};
  result["machine_busy"] = speed.is_busy;
  const auto adjoint = compiled.derived.find(compiled.step_name());
  if (compiled.problem->task && adjoint != compiled.derived.end() && adjoint->second.adjoint)
    result["adjoint_cost"] = cost_json(driver::cost_of(compiled.loop, adjoint->second.adjoint->program), speed);
  const double rate = speed.points(cost.bytes, cost.flops);
  if (!std::isfinite(rate)) {
    report.say("cost: a step moves and computes nothing\n");
    return report;
  }
  const bool is_of_memory = cost.bytes > 0 && rate == speed.copy / cost.bytes;
  report.say(fmt::format("cost: {} bytes and {} flops a cell and step; {} allows {} points/s here{}\n", cost.bytes,
                         cost.flops, is_of_memory ? "memory" : "arithmetic", human_count(rate),
                         speed.is_busy ? ", measured on a busy machine" : ""));
  report.add_detail(fmt::format("  this machine was measured {}{}\n", speed.date,
                                speed.is_busy ? fmt::format(", at a load of {:.1f} a core", speed.load) : ""));
  return report;
}

Report whole_grid_report(const driver::Compiled& compiled) {
  Report report;
  Json& result = report.json;
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
  report.add_detail(std::move(text));
  return report;
}

Report gradient_memory_report(const driver::Compiled& compiled, const SourceFile& source,
                              const GradientLimits& limits) {
  Report report;
  Json& result = report.json;
  const driver::Memory memory = driver::memory_of(compiled);
  const driver::StorageOptions storage{limits.threads, limits.checkpoint_bytes, limits.checkpoint_folder};
  const std::optional<GradientPlan> plan = driver::plan_of_gradient(compiled, storage);
  result["gradient_memory_bytes_per_part"] = memory.part;
  const double stored = plan ? memory.gradient + static_cast<double>(plan->checkpoint_bytes + plan->tape_bytes) : 0;
  result["gradient_memory_bytes"] = plan ? Json(stored) : Json(nullptr);
  result["checkpoints"] = nullptr;
  result["gradient_peak_bytes"] = nullptr;
  if (!plan) return report;
  const double peak = driver::plan_of_gradient_memory(compiled, storage, source)->peak;
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
  if (!limits.checkpoint_folder.empty()) text += " in a file";
  if (memory.part > 0)
    text += fmt::format(", with {} more for each part of the step that is split into most", human_bytes(memory.part));
  report.say(std::move(text));
  return report;
}

Report savings_report(const driver::Compiled& compiled, const SourceFile& source) {
  const std::optional<driver::Traffic> full = driver::traffic_in_full(source, compiled);
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
  Report report;
  report.json["saved"] = std::move(saved);
  if (!text.empty()) report.add_detail(text + "\n");
  return report;
}

}  // namespace dpde::report
