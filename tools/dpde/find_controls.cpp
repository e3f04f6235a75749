// SPDX-License-Identifier: Apache-2.0
#include "find_controls.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <set>

#include "driver/report/run_description.h"
#include "interrupt.h"
#include "netcdf_output.h"
#include "progress.h"
#include "report/finished.h"
#include "scene_output.h"
#include "support/maths/evaluate.h"
#include "support/names/number_text.h"
#include "window_part.h"

namespace dpde::tools {

namespace {

/// Controls of all windows, in order.
using Found = std::vector<training::FoundControls>;

/// For runs whose windows were all solved.
NetcdfContent content_of(const Job& job, driver::Session& session, const training::TrainingScene& scene,
                         const std::vector<std::string>& states, const Found& all) {
  NetcdfContent content;
  NetcdfNames names = free_names(session);
  content.attributes = attributes_of(job, session);
  content.attributes.insert(content.attributes.end(),
                            {{"dpde_task", scene.task().name}, {"dpde_trajectories", scene.trajectories.path}});
  const AxisNames axes = add_axes(content, driver::run_axes(session.problem(), session.axes()), names);
  const std::string time = names.free("time");
  const std::vector<double>& frame_times = scene.trajectories.times;
  const std::vector<std::string>& params = scene.trajectories.params;
  std::vector<int> runs;
  for (const training::FoundControls& found : all) {
    if (runs.empty() || runs.back() != found.window.run) runs.push_back(found.window.run);
  }
  const std::size_t frames =
      all.size() / runs.size() * static_cast<std::size_t>(scene.steps() / scene.trajectories.every);
  content.dimensions.insert(content.dimensions.end(), {{"run", static_cast<std::int64_t>(runs.size())},
                                                       {time, static_cast<std::int64_t>(frames)}});
  content.variables.push_back(
      time_variable(time, session.problem().unit_of("t"),
                    {frame_times.begin() + 1, frame_times.begin() + 1 + static_cast<std::ptrdiff_t>(frames)}));
  for (std::size_t s = 0; s < states.size(); ++s) {
    const model::Placement placement = driver::placement_of(session.problem(), states[s]);
    NetcdfVariable variable{states[s],
                            {"run", time},
                            described("field " + states[s], session.problem().unit_of(states[s])),
                            {},
                            session.problem().scheme.real == Precision::f32};
    for (std::size_t a = axes.size(); a-- > 0;) variable.dimensions.push_back(axes[a][placement[a] ? 1 : 0]);
    for (const training::FoundControls& found : all)
      variable.values.insert(variable.values.end(), found.states[s].begin(), found.states[s].end());
    content.variables.push_back(std::move(variable));
  }
  for (std::size_t p = 0; p < params.size(); ++p) {
    NetcdfVariable variable{params[p], {"run"}, described("parameter " + params[p]), {}};
    for (const int run : runs)
      variable.values.push_back(scene.trajectories.runs[static_cast<std::size_t>(run)].params[p]);
    content.variables.push_back(std::move(variable));
  }
  for (const RunNumber& param : driver::run_params(session.problem())) {
    const bool differs = std::ranges::find(params, param.name) != params.end();
    if (!differs) content.variables.push_back(parameter_variable(param));
  }
  return content;
}

/// Entry k: mean loss over the windows before iteration k; finished windows count with their last one.
std::vector<double> mean_losses(const Found& all) {
  std::size_t most = 0;
  for (const training::FoundControls& found : all) most = std::max(most, found.losses.size());
  std::vector<double> mean(most);
  for (const training::FoundControls& found : all) {
    for (std::size_t k = 0; k < most; ++k)
      mean[k] += found.losses[std::min(k, found.losses.size() - 1)] / static_cast<double>(all.size());
  }
  return mean;
}

/// Always reports failed searches, and removes their runs: the file cannot have gaps.
Json leave_out(Job& job, const training::TrainingScene& scene, Found& all) {
  Json left_out = Json::array();
  std::set<int> runs;
  for (const training::FoundControls& found : all) {
    if (found.why.empty()) continue;
    const auto& [run, frame] = found.window;
    runs.insert(run);
    left_out.push_back({{"run", run}, {"frame", frame}, {"why", found.why}});
    job.tell(fmt::format("no controls for the window from frame {} of run {}: {}; run {} is left out of {}.nc", frame,
                         run, found.why, run, scene.task().name));
  }
  std::erase_if(all, [&](const training::FoundControls& found) { return runs.contains(found.window.run); });
  return left_out;
}

constexpr const char* what_may_help = "bounds of the controls, shorter windows or a smaller step of the scene may help";

report::Report found_report(const std::string& task, const Found& all) {
  report::Report report;
  const std::vector<double> losses = mean_losses(all);
  double norm = 0;
  for (const training::FoundControls& found : all) norm = std::hypot(norm, found.norm);
  report.say(fmt::format("{}: controls of {} windows; mean loss {:.8g}, {:.8g} without\n", task, all.size(),
                         shown(losses.back()), shown(losses.front())));
  report.json["iterations"] = losses.size() - 1;
  report.json["loss"] = json_numbers(losses);
  report.json["windows"] = all.size();
  report.json["unknowns"] = {{"controls", {{"norm", json_number(norm)}}}};
  report.json["test"] = Json::object();
  return report;
}

/// For a search that was completed before.
Json again(Job& job, const std::string& task, const report::Report& report) {
  job.say(fmt::format("{0}: all windows are searched already, {0}.nc is there\n{1}", task, report.text()));
  Json json = report.json;
  json["finished"] = true;
  json["files"] = job.files();
  return json;
}

/// Also loads windows solved before. Returns false when stopped or if saving failed.
bool search(Job& job, training::WindowControls& controls,
            const std::function<WindowPart(const training::Window&)>& part, bool quiet, Found& all) {
  const std::vector<training::Window> windows = controls.windows();
  std::vector<training::Window> rest;
  for (const training::Window& window : windows) {
    const bool is_there = std::ranges::any_of(all, [&](const training::FoundControls& found) {
      return found.window.run == window.run && found.window.frame == window.frame;
    });
    if (!is_there) rest.push_back(window);
  }
  const std::size_t before = all.size();
  Progress progress(job.options().streams.err, false, quiet);
  const bool complete = controls.find(rest, [&](training::FoundControls found) {
    if (!part(found.window).save(found, job.sink())) return false;
    all.push_back(std::move(found));
    progress.show(fmt::format("window {} of {}  loss {:.6g}", all.size(), windows.size(),
                              all.back().losses.empty() ? std::nan("") : all.back().losses.back()),
                  static_cast<int>(all.size() - before), static_cast<int>(rest.size()));
    return true;
  });
  if (complete || job.failed()) return complete;
  job.sink().report("optimiser-interrupted", {},
                    {fmt::format("{} (windows)", all.size()), fmt::format("{}", windows.size())},
                    "the same command with --resume searches the others");
  return false;
}

bool takes(Job& job, const OptimizeOptions& options, const training::TrainingScene& scene) {
  if (options.epochs <= 0 && !options.out.empty()) return true;
  const std::string& task = scene.task().name;
  job.sink().report(
      "bad-option", scene.task().optimiser->origin.range,
      {options.out.empty() ? fmt::format("task {} needs --out DIR, for the file {}.nc of what it finds", task, task)
                           : fmt::format("--epochs is not for task {}, which seeks controls for each window", task)},
      options.out.empty() ? "add --out DIR to the command" : "--iterations says how long it seeks them");
  return false;
}

/// Removes windows without a result from `all`.
report::Report report_of_rest(Job& job, const training::TrainingScene& scene, const training::WindowControls& controls,
                              Found& all) {
  report::Report report;
  report.json["left_out"] = leave_out(job, scene, all);
  report.json["frames_left_over"] = controls.frames_left_over();
  if (controls.frames_left_over() > 0) {
    report.say(
        fmt::format("the last {} of {} frames of each run fill no window of {} steps: nothing is sought for them\n",
                    controls.frames_left_over(), scene.trajectories.frame_count(), scene.steps()));
  }
  tell(job, report);
  if (!report.json["left_out"].empty()) job.tell(what_may_help);
  return report;
}

}  // namespace

Json find_controls(Job& job, const OptimizeOptions& options, const TaskRun& run, const training::TrainingScene& scene,
                   const training::BatchOptions& batch) {
  Json json = Json::object();
  const std::string& task = scene.task().name;
  if (!takes(job, options, scene)) return json;
  const auto session = driver::Session::open(job.source(), run.compiled, {.slots = 1}, job.sink());
  if (!session) return json;
  say_certificate(job, run);
  training::WindowControls controls(scene, options.iterations, batch);
  const std::uint64_t key = controls.key();
  const std::string result_file = task + ".nc";
  const std::filesystem::path path = std::filesystem::path(options.out) / result_file;
  const auto part = [&](const training::Window& window) { return WindowPart(path, key, window); };
  if (const auto finished = options.resume ? report::report_of_finished(path, key) : std::nullopt) {
    json = again(job, task, *finished);
    json["resumed_windows"] = controls.windows().size();
    return json;
  }
  Found all;
  for (const training::Window& window : controls.windows()) {
    std::optional<training::FoundControls> found = options.resume ? part(window).load() : std::nullopt;
    if (found) all.push_back(std::move(*found));
  }
  json["resumed_windows"] = all.size();
  if (options.resume)
    job.say(fmt::format("{} of {} windows were there already\n", all.size(), controls.windows().size()));
  const auto start = std::chrono::steady_clock::now();
  if (!search(job, controls, part, options.quiet || options.json, all)) return json;
  std::ranges::sort(
      all, {}, [](const training::FoundControls& found) { return std::pair(found.window.run, found.window.frame); });
  report::Report report = report_of_rest(job, scene, controls, all);
  json.update(report.json);
  if (all.empty()) {
    job.sink().report("run-failed", {},
                      {fmt::format("every run has a window without controls: nothing is written to {}.nc", task)},
                      what_may_help);
    return json;
  }
  const report::Report found = found_report(task, all);
  tell(job, found);
  report.append(found);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  job.say(fmt::format("found in {}\n", human_seconds(seconds)));
  NetcdfContent content = content_of(job, *session, scene, controls.states(), all);
  report::add_report(content, key, report);
  save_text(job, result_file, compose_netcdf(std::move(content)));
  json.update(report.json);
  json["finished"] = true;
  json["wall_s"] = seconds;
  json["compile_s"] = run.compiled->seconds;
  json["certificate"] = certificate_json(run);
  if (!job.failed()) {
    for (const training::Window& window : controls.windows()) part(window).remove();
  }
  json["files"] = job.files();
  return json;
}

}  // namespace dpde::tools
