// SPDX-License-Identifier: Apache-2.0
// dpde chart: speed against accuracy. Runs a scene with several methods, cells and steps, and draws error against time.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "chart/budget.h"
#include "chart/points_file.h"
#include "chart/sweep.h"
#include "chart_scene.h"
#include "command.h"
#include "dpde/runtime/bytes.h"
#include "interrupt.h"
#include "model/from_ast.h"
#include "progress.h"
#include "report/chart_of_scene.h"
#include "report/scene/formal_order.h"
#include "scene_output.h"
#include "syntax/parser.h"
#include "train.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

struct ChartOptions : CommonOptions {
  ChartWishes wishes;
  double tolerance = 0;  // 0: from the chart block
  bool progress = false, resume = false, budget = false;
};

class Chart {
 public:
  Chart(Job& job, const ChartOptions& options)
      : job_(job), options_(options), progress_(options.streams.err, options.progress, options.quiet || options.json) {}

  Json operator()();

 private:
  std::vector<chart::Point> run_entries(const std::vector<chart::Entry>& entries);

  Job& job_;
  const ChartOptions& options_;
  Progress progress_;
  ChartScene scene_;
  chart::References references_;
  chart::PointsFile file_;
  int same_steps_ = 0;  // entries that equal another one, since their steps were rounded
};

/// Text of the settings that all points share, and in which another chart may differ.
std::string run_text(const Job& job, const std::string& reference) {
  const CommonOptions& options = job.options();
  const std::string_view text = job.source().text();
  return fmt::format("{:016x} {} {} {} {} {} {} {}", hash_bytes(text.data(), text.size()), version, options.name,
                     options.scheme, options.backend, thread_count(options), fmt::join(options.set, " "), reference);
}

std::vector<chart::Point> Chart::run_entries(const std::vector<chart::Entry>& entries) {
  std::vector<chart::Point> points;
  std::string against =
      fmt::format("{} {} {}", references_.states.text(), scene_.options.task, references_.gradient.text());
  for (const chart::Measure& measure : scene_.options.measures) against += " " + chart::text_of(measure);
  const std::string run = run_text(job_, against);
  for (const chart::Entry& entry : entries) {
    progress_.show(chart::method_text(entry.variant), static_cast<int>(points.size()),
                   static_cast<int>(entries.size()));
    const std::string key = file_.key_of(run, entry);
    std::optional<chart::Point> point = file_.find(key, entry);
    if (!point) {
      point = chart::run_point(job_.source(), scene_.options, scene_.session->problem(), entry, references_, points);
    }
    if (std::ranges::find(points, point->variant, &chart::Point::variant) != points.end()) {
      ++same_steps_;
      continue;
    }
    if (options_.budget && is_complete(*point) && !point->budget)
      point->budget = chart::budget_of(job_.source(), scene_.options, *point);
    if (interrupt_flag().load()) break;
    file_.add(key, *point);
    points.push_back(std::move(*point));
    if (!options_.out.empty()) file_.save(job_.sink());
  }
  chart::mark_pareto(points);
  return points;
}

/// False for a scene or a chart block, which may have the same name.
bool names_task(const Job& job) {
  DiagnosticSink unread;  // reported when the scene is compiled
  const ast::File file = ast::parse(job.source(), unread);
  const auto is_among = [&](const std::vector<std::string>& names) {
    return std::ranges::find(names, job.options().name) != names.end();
  };
  return is_among(model::task_names(file)) && !is_among(model::chart_names(file));
}

/// Trains, or loads the training from the folder of --out if it is there.
Json chart_training(Job& job, const ChartOptions& options) {
  const ChartWishes& wishes = options.wishes;
  if (!wishes.vary.empty() || !wishes.errors.empty() || !wishes.task.empty() || wishes.manufactured || options.budget ||
      options.tolerance > 0) {
    job.sink().report(
        "bad-option", {},
        {fmt::format("task {} learns: its chart is of its tests, by methods that the tool chooses", options.name)},
        "without --vary, --error, --task, --manufactured, --tolerance and --budget");
    return Json::object();
  }
  OptimizeOptions training;
  static_cast<CommonOptions&>(training) = options;
  training.chart = {wishes.timing.samples, wishes.timing.seconds};
  training.resume = !options.out.empty();
  return train(job, training);
}

/// Prints the chart; with --out also writes table, picture and `result` to files NAME.
void write_chart(Job& job, const report::ChartOfScene& chart, const std::string& name, Json& result) {
  const report::Report report = report::chart_report(chart);
  result.update(report.json);
  tell(job, report);
  if (!job.options().out.empty()) {
    save_text(job, name + ".csv", report::chart_table(chart.points));
    const std::vector<plot::Panel> panels = report::chart_panels(chart);
    if (!panels.empty())
      save_picture(job, name, panels);
    else
      job.say("no picture: its axis is logarithmic, and no point has an error above 0\n");
    save_text(job, name + ".json", result.dump(1) + "\n");
  }
  result["files"] = job.files();
}

Json Chart::operator()() {
  Json result = Json::object();
  if (options_.resume && options_.out.empty())
    job_.sink().report("bad-option", {}, {"--resume needs the --out DIR of the chart"});
  if (job_.failed()) return result;
  if (!job_.load_source() || !prepare_out(job_)) return result;
  if (names_task(job_)) {
    const std::optional<bool> learns = learns_from_trajectories(job_);
    if (!learns) return result;
    if (*learns) return chart_training(job_, options_);
  }
  if (!open_chart_scene(job_, options_.wishes, scene_)) return result;
  const model::Problem& problem = scene_.session->problem();
  report::warn_of_jumps(driver::jumps_in_fluxes(*scene_.session), job_.sink());
  const std::string name = scene_.block ? scene_.block->name : problem.scene + "_chart";
  if (!options_.out.empty() && !file_.open(options_.out, name, options_.resume, job_.sink())) return result;
  const std::vector<chart::Entry> entries = chart::entries_of(problem, scene_.wishes);
  if (!find_references(job_, scene_, chart::finest_of(problem, entries), progress_, references_)) return result;
  const std::vector<chart::Point> points = run_entries(entries);
  if (interrupt_flag().load())
    job_.sink().report("run-failed", {}, {"stopped before all points were run; the chart is of those that were"},
                       options_.out.empty() ? "" : "the same command with --resume goes on from here");
  if (!points.empty() && std::ranges::all_of(points, &chart::Point::does_not_fit))
    job_.sink().report("bad-option", {}, {fmt::format("no variant fits the scene: {}", points.front().failure)});
  if (same_steps_ > 0)
    job_.say(fmt::format("{} of {} points left out: their fractions give steps that others have\n", same_steps_,
                         entries.size()));
  const double in_block = scene_.block ? scene_.block->tolerance : 0;
  const double tolerance = options_.tolerance > 0 ? options_.tolerance : in_block;
  write_chart(job_, {problem, points, references_, scene_.options.task, tolerance, scene_.options.threads}, name,
              result);
  return result;
}

}  // namespace

void add_chart(CLI::App& app, Console& console) {
  const auto options = std::make_shared<ChartOptions>();
  CLI::App* verb =
      app.add_subcommand("chart", "speed against accuracy: error against time for methods, cells and steps");
  add_common_options(*verb, *options, console);
  add_chart_options(*verb, options->wishes, "the median");
  verb->add_flag("--progress", options->progress, "show progress although standard error is no terminal");
  verb->add_option("--tolerance", options->tolerance, "drawn as a wall; the fastest point that meets it is told")
      ->check(positive());
  verb->add_flag("--budget", options->budget, "of each point's error the parts of cells, steps and rounding");
  verb->add_flag("--resume", options->resume, "take over the points that --out holds already");
  verb->footer(
      "Examples:\n  dpde chart advection.dpde ring --out results\n  dpde chart burgers.dpde ends --vary "
      "advect=central2,central4,upwind3 --vary time=ssp_rk3,rk4 --vary cells=64,128,256\n  dpde chart heat.dpde rod "
      "--vary real=f32,f64 --vary fraction=0.9,0.3 --json\n\nThe name may be that of a chart block, whose lines "
      "options "
      "replace; or a task that learns, whose network is drawn beside plain methods, with the cost of its training. The "
      "error is that at the end of the scene, against its exact solution or else a finer run.");
  on_call(*verb, console, [options] { return call(*options, [&](Job& job) { return Chart(job, *options)(); }); });
}

}  // namespace dpde::tools
