// SPDX-License-Identifier: Apache-2.0
// dpde tune: finds the cheapest scheme, cells, step and precision that meet a tolerance, and proves it by a run.
#include "chart/tune.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>

#include "analysis/unused.h"
#include "chart_scene.h"
#include "command.h"
#include "interrupt.h"
#include "model/print/print_model.h"
#include "progress.h"
#include "scene_output.h"
#include "syntax/expand/whole_scenes.h"
#include "syntax/print/print_ast.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

constexpr double reference_part = 3;  // the reference must be accurate to 1/3 of the tolerance to prove anything

struct TuneCommand : CommonOptions {
  ChartWishes wishes;
  double tolerance = 0, most_cells = 8;
  bool progress = false, gradient = false;
};

Json chosen_json(const chart::Point& point) {
  Json json = Json::object();
  for (const auto& [key, value] : point.variant.method) json[key] = value;
  json["cells"] = point.cells;
  json["step"] = point.step;
  return json;
}

/// The rest of a scene's line after its step; "" without a Courant number.
std::string courant_text(const ast::File& file, const model::Problem& chosen) {
  if (!(chosen.substeps.courant > 0)) return "";
  std::string text = fmt::format(", courant {}", chosen.substeps.courant);
  DiagnosticSink unread;  // it was compiled before: no new messages
  for (const ast::Declaration& declaration : ast::with_whole_scenes(file, unread).value_or(file).declarations) {
    const ast::Scene* scene = std::get_if<ast::Scene>(&declaration.kind);
    if (scene == nullptr || scene->name.name != chosen.scene) continue;
    for (const ast::Item& item : scene->items) {
      const ast::TimeItem* time = get_if<ast::TimeItem>(&item.kind);
      if (time != nullptr && time->speed) text += ", speed " + print(*time->speed);
    }
  }
  return text;
}

/// Text to paste: a scheme block with all settings of the chosen one, and lines of the scene.
std::string text_to_paste(const chart::Point& point, const driver::Compiled& compiled) {
  const model::Problem& chosen = *compiled.problem;
  model::Scheme scheme = chosen.scheme;
  scheme.name = "tuned";
  std::string text = model::print(scheme);
  if (!text.ends_with("\n")) text += "\n";
  for (std::size_t a = 0; chosen.has_grid && a < chosen.axes.size(); ++a)
    text += fmt::format("# grid {}: cells {}\n", chosen.axes[a].name, point.cells[a]);
  return text + fmt::format("# time {} .. {:.15g}, step {:.15g}{}\n", chosen.t_begin,
                            chosen.t_begin + chosen.steps * chosen.step, point.step,
                            courant_text(compiled.ast, chosen));
}

void report_reference(Job& job, const ChartScene& scene, const chart::References& references, Json& result) {
  const bool of_gradient = scene.is_gradient_alone;
  const std::string text = of_gradient ? references.gradient.text() : references.states.text();
  const double uncertainty = of_gradient ? references.gradient.uncertainty() : references.states.uncertainty();
  result["reference"] = {{"text", text}, {"uncertainty", json_number(uncertainty)}};
  job.say(fmt::format("errors against {}{}\n", text,
                      uncertainty > 0 ? fmt::format(", which is known to {:.2g}", uncertainty) : ""));
}

void report_choice(Job& job, const ChartScene& scene, const chart::Choice& choice, double tolerance, Json& result) {
  const model::Problem& problem = scene.session->problem();
  result["scene"] = problem.scene;
  result["tolerance"] = tolerance;
  result["tried"] = choice.tried;
  result["runner_up"] = Json::array();
  for (const chart::RunnerUp& other : choice.runners_up) {
    result["runner_up"].push_back(
        {{"method", chart::method_text(other.point.variant)},
         {"cells", other.point.cells},
         {"step", other.point.step},
         {"error", other.point.failure.empty() ? json_number(other.point.error) : Json(nullptr)},
         {"reason", other.reason}});
  }
  result["chosen"] = nullptr;
  if (choice.chosen) {
    const chart::Point& point = *choice.chosen;
    result["chosen"] = chosen_json(point);
    result["error"] = point.error;
    result["wall_s"] = point.seconds;
    std::string why;
    const auto session = chart::open(job.source(), scene.options, point.variant, why);
    const std::string text = session == nullptr ? "" : text_to_paste(point, session->compiled());
    result["text"] = text;
    job.say(fmt::format("{}: {} on {} cells, steps of {:.6g}: error {:.3g}, {:.3g} s {}, after {} runs\n\n{}\n",
                        problem.scene, chart::method_text(point.variant), fmt::join(point.cells, " x "), point.step,
                        point.error, point.seconds,
                        scene.is_gradient_alone ? "a value with its gradient" : "a unit of time", choice.tried, text));
  }
  for (const chart::RunnerUp& other : choice.runners_up) {
    std::string place;
    if (!other.point.cells.empty())
      place = fmt::format(" ({} cells, step {:.4g}{})", fmt::join(other.point.cells, " x "), other.point.step,
                          other.point.failure.empty() ? fmt::format(", error {:.3g}", other.point.error) : "");
    job.say(fmt::format("  not {}{}: {}\n", chart::method_text(other.point.variant), place, other.reason));
  }
}

/// From the option, the chart block or the scene's line; also sets the error measure. 0 after a diagnostic.
double find_tolerance(Job& job, const TuneCommand& options, ChartScene& scene) {
  const std::optional<model::Accuracy>& accuracy = scene.session->problem().accuracy;
  if (accuracy && scene.options.measures.empty()) {
    for (const std::string& state : accuracy->states) scene.options.measures.push_back({state});
  }
  if (options.tolerance > 0) return options.tolerance;
  if (scene.block && scene.block->tolerance > 0) return scene.block->tolerance;
  if (accuracy) return accuracy->tolerance;
  job.sink().report("bad-option", job.place(), {"there is no tolerance"},
                    "--tolerance 1e-3, or a line of the scene: accuracy 1e-3 on u");
  return 0;
}

/// Whether the references are accurate enough for the tolerance; adds a diagnostic if not.
bool is_known_well(Job& job, const ChartScene& scene, const chart::References& references, bool of_gradient,
                   double tolerance) {
  const double uncertainty = of_gradient ? references.gradient.uncertainty() : references.states.uncertainty();
  if (uncertainty * reference_part <= tolerance) return true;
  const std::string text = of_gradient ? references.gradient.text() : references.states.text();
  job.sink().report("no-reference", job.place(),
                    {scene.session->problem().scene,
                     fmt::format("{} is known to {:.2g} only, which cannot prove {:g}", text, uncertainty, tolerance)},
                    "a larger --tolerance, more --most-cells, or an exact solution: exact u = ...");
  return false;
}

/// Along each axis, in units of the scene's: the run of the reference has twice as many.
double most_cells_of(Job& job, const TuneCommand& options, const ChartScene& scene) {
  const int cells = scene.session->problem().axes.front().cells;
  if (scene.reference_cells == 0) return options.most_cells;
  if (scene.reference_cells < 2 * cells)
    job.sink().report(
        "no-reference", job.place(),
        {scene.session->problem().scene,
         fmt::format("a run on {} cells is no reference for the scene's {}", scene.reference_cells, cells)},
        fmt::format("twice as many at least: --reference-cells {}", 2 * cells));
  return std::min(options.most_cells, 0.5 * scene.reference_cells / cells);
}

bool open_tuning(Job& job, const TuneCommand& options, ChartScene& scene) {
  if (!std::isfinite(options.tolerance) || !std::isfinite(options.most_cells))
    job.sink().report("bad-option", {}, {"--tolerance and --most-cells are finite numbers"});
  if (job.failed() || !job.load_source() || !prepare_out(job) || !open_chart_scene(job, options.wishes, scene))
    return false;
  if (!scene.block && (!scene.wishes.cells.empty() || !scene.wishes.steps.empty()))
    job.sink().report("bad-option", {}, {"dpde tune chooses cells and steps by itself: --vary has scheme keys here"});
  if (options.gradient && scene.options.task.empty())
    job.sink().report("bad-option", {}, {"--gradient needs a task"}, "name one: dpde tune FILE TASK, or --task TASK");
  if (!options.gradient && !options.wishes.task.empty())
    job.sink().report("bad-option", {}, {"--task is for gradients"}, "add --gradient, or name the scene alone");
  if (!options.gradient) scene.options.task.clear();
  scene.is_gradient_alone = options.gradient;
  return !job.failed();
}

Json tune_scene(Job& job, const TuneCommand& options) {
  Json result = Json::object();
  ChartScene scene;
  if (!open_tuning(job, options, scene)) return result;
  const double tolerance = find_tolerance(job, options, scene);
  if (!(tolerance > 0)) return result;
  scene.accuracy = tolerance / reference_part;
  const model::Problem& problem = scene.session->problem();
  Progress progress(options.streams.err, options.progress, options.quiet || options.json);
  chart::References references;
  const double most_cells = most_cells_of(job, options, scene);
  if (job.failed() || !find_references(job, scene, most_cells, progress, references) ||
      !is_known_well(job, scene, references, options.gradient, tolerance))
    return result;
  int runs = 0;
  const auto tell = [&](const std::string& what) {
    ++runs;
    progress.show(what, runs, runs + 10);  // the final number is unknown
  };
  const chart::TuneOptions tuning{scene.options, tolerance, most_cells, options.gradient, {}, tell};
  chart::Choice choice = chart::tune(job.source(), tuning, problem, scene.wishes, references);
  if (choice.chosen && !chart::is_complete(*choice.chosen)) choice.chosen.reset();  // stopped before it was proved
  report_reference(job, scene, references, result);
  report_choice(job, scene, choice, tolerance, result);
  if (choice.chosen && chosen_json(*choice.chosen).value<std::string>("real", "") == "f32")
    analysis::keep_single_precision(scene.session->compiled(), job.source(), tolerance, choice.chosen->error);
  if (interrupt_flag().load()) {
    job.sink().report("run-failed", {}, {"stopped before all methods were tried; what is told is of those that were"});
  } else if (!choice.chosen) {
    job.sink().report("no-choice", job.place(), {fmt::format("{:g}", tolerance)},
                      "more --most-cells, other methods (--vary), or a larger --tolerance");
  }
  if (!job.options().out.empty()) save_text(job, problem.scene + "_tune.json", result.dump(1) + "\n");
  result["files"] = job.files();
  return result;
}

}  // namespace

void add_tune(CLI::App& app, Console& console) {
  const auto options = std::make_shared<TuneCommand>();
  CLI::App* verb = app.add_subcommand("tune", "the cheapest scheme, cells, step and precision that meets a tolerance");
  add_common_options(*verb, *options, console);
  verb->add_option("--tolerance", options->tolerance,
                   "relative error at the end of the scene (root mean square); else what the scene's accuracy says")
      ->check(positive());
  verb->add_flag("--gradient", options->gradient, "the error and the seconds are those of the gradient of the task");
  add_chart_options(*verb, options->wishes, "the shortest");
  verb->add_option("--most-cells", options->most_cells, "along each axis, in units of the scene's")
      ->check(positive())
      ->capture_default_str();
  verb->add_flag("--progress", options->progress, "show progress although standard error is no terminal");
  verb->footer(
      "Examples:\n  dpde tune advection.dpde ring --tolerance 1e-4\n  dpde tune heat.dpde rod --tolerance 1e-5 --vary "
      "lap=central2,central4,central6 --vary time=euler,rk4 --json");
  on_call(*verb, console, [options] { return call(*options, [&](Job& job) { return tune_scene(job, *options); }); });
}

}  // namespace dpde::tools
