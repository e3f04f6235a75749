// SPDX-License-Identifier: Apache-2.0
#include "find_controls.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "interrupt.h"
#include "netcdf_output.h"
#include "progress.h"
#include "scene_output.h"
#include "support/evaluate.h"

namespace dpde::tools {

namespace {

/// Windows of a run, in their order.
using Found = std::vector<driver::FoundControls>;

NetcdfContent content_of(const Job& job, driver::Session& session, const driver::TrainingScene& scene, const std::vector<std::string>& states, const Found& all) {
  NetcdfContent content;
  NetcdfNames names(session);
  add_origin(content, job, session);
  content.attributes.insert(content.attributes.end(), {{"dpde_task", scene.task().name}, {"dpde_trajectories", scene.trajectories.path}});
  const AxisNames axes = add_axes(content, session, session.workspace().axes(), names);
  const std::string time = names.free("time");
  const std::vector<double>& frame_times = scene.trajectories.times;
  const std::vector<std::string>& params = scene.trajectories.params;
  const std::vector<driver::Trajectories::Run>& runs = scene.trajectories.runs;
  const std::size_t frames = all.size() / runs.size() * static_cast<std::size_t>(scene.steps() / scene.trajectories.every);
  content.dimensions.insert(content.dimensions.end(), {{"run", static_cast<std::int64_t>(runs.size())}, {time, static_cast<std::int64_t>(frames)}});
  NetcdfVariable times{time, {time}, described("time"), {frame_times.begin() + 1, frame_times.begin() + 1 + static_cast<std::ptrdiff_t>(frames)}};
  times.attributes.push_back({"axis", "T"});
  content.variables.push_back(std::move(times));
  for (std::size_t s = 0; s < states.size(); ++s) {
    const model::Placement placement = placement_of(session, states[s]);
    NetcdfVariable variable{states[s], {"run", time}, described("field " + states[s]), {}, session.problem().scheme.real == Precision::f32};
    for (std::size_t a = axes.size(); a-- > 0;) variable.dimensions.push_back(axes[a][placement[a] ? 1 : 0]);
    for (const driver::FoundControls& found : all) variable.values.insert(variable.values.end(), found.states[s].begin(), found.states[s].end());
    content.variables.push_back(std::move(variable));
  }
  for (std::size_t p = 0; p < params.size(); ++p) {
    NetcdfVariable variable{params[p], {"run"}, described("parameter " + params[p]), {}};
    for (const driver::Trajectories::Run& run : runs) variable.values.push_back(run.params[p]);
    content.variables.push_back(std::move(variable));
  }
  for (const model::Parameter& param : session.problem().params) {
    const bool differs = std::ranges::find(params, param.name) != params.end();
    if (!differs && session.problem().find_control(param.name) == nullptr) content.variables.push_back({param.name, {}, described("parameter " + param.name), {param.value}});
  }
  return content;
}

/// Entry k: the mean over the windows before iteration k, those that are done with their last.
std::vector<double> mean_losses(const Found& all) {
  std::size_t most = 0;
  for (const driver::FoundControls& found : all) most = std::max(most, found.losses.size());
  std::vector<double> mean(most);
  for (const driver::FoundControls& found : all) {
    for (std::size_t k = 0; k < most; ++k) mean[k] += found.losses[std::min(k, found.losses.size() - 1)] / static_cast<double>(all.size());
  }
  return mean;
}

void report(Job& job, const std::string& task, const Found& all, double seconds, Json& json) {
  const std::vector<double> losses = mean_losses(all);
  double squares = 0;
  for (const driver::FoundControls& found : all) squares += found.norm * found.norm;
  job.say(fmt::format("{}: controls of {} windows in {}; mean loss {:.8g}, {:.8g} without\n", task, all.size(), human_seconds(seconds), shown(losses.back()), shown(losses.front())));
  json["iterations"] = losses.size() - 1;
  json["loss"] = json_numbers(losses);
  json["windows"] = all.size();
  json["wall_s"] = seconds;
  json["unknowns"] = {{"controls", {{"norm", json_number(std::sqrt(squares))}}}};
  json["test"] = Json::object();
}

}  // namespace

Json find_controls(Job& job, const OptimizeOptions& options, const TaskRun& run, const driver::TrainingScene& scene, const driver::BatchOptions& batch) {
  Json json = Json::object();
  const std::string& task = scene.task().name;
  if (options.resume || options.epochs > 0 || options.out.empty()) {
    job.sink().report("bad-option", {}, {options.out.empty() ? fmt::format("task {} needs --out DIR, for the file {}.nc of what it finds", task, task)
                                                             : fmt::format("--resume and --epochs are not for task {}, which seeks controls for each window", task)});
    return json;
  }
  const auto session = driver::Session::open(job.source(), run.compiled, {.slots = 1}, job.sink());
  if (!session) return json;
  driver::WindowControls controls(scene, options.iterations, batch);
  const std::vector<driver::Window> windows = controls.windows();
  Progress progress(false, options.quiet || options.json);
  Found all;
  const auto start = std::chrono::steady_clock::now();
  const bool complete = controls.find(windows, [&](driver::FoundControls found) {
    all.push_back(std::move(found));
    progress.show(fmt::format("window {} of {}  loss {:.6g}", all.size(), windows.size(), all.back().losses.back()), static_cast<int>(all.size()), static_cast<int>(windows.size()));
  });
  if (!complete) {
    job.sink().report("optimiser-interrupted", {}, {fmt::format("{} (windows)", all.size()), fmt::format("{}", windows.size())}, "nothing is written: the same command begins anew");
    return json;
  }
  std::ranges::sort(all, {}, [](const driver::FoundControls& found) { return std::pair(found.window.run, found.window.frame); });
  for (const driver::FoundControls& found : all) {
    if (std::isfinite(found.losses.back())) continue;
    job.sink().report("loss-not-finite", scene.task().losses.front().origin.range, {"not finite", fmt::format("{}", found.losses.size() - 1)},
                      fmt::format("in the window from frame {} of run {}", found.window.frame, found.window.run));
    return json;
  }
  report(job, task, all, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), json);
  json["compile_s"] = run.compiled->seconds;
  json["certificate"] = certificate_json(run);
  save_text(job, task + ".nc", compose_netcdf(content_of(job, *session, scene, controls.states(), all)));
  json["files"] = job.files();
  return json;
}

}  // namespace dpde::tools
