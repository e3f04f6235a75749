// SPDX-License-Identifier: Apache-2.0
// dpde chart: speed against accuracy. Runs a scene by several methods, cells and steps, and draws error against time.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <memory>

#include "chart/sweep.h"
#include "chart_output.h"
#include "command.h"
#include "interrupt.h"
#include "preparing.h"
#include "progress.h"
#include "scene_output.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

struct ChartOptions : CommonOptions {
  std::vector<std::string> vary;
  int samples = 5;
  double sample_seconds = 0.1;
  bool progress = false, resume = false;
};

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts(1);
  int depth = 0;
  for (const char c : text) {
    depth += c == '(' ? 1 : c == ')' ? -1 : 0;
    if (c == ',' && depth == 0) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

template <class Number>
bool read_numbers(const std::vector<std::string>& texts, std::vector<Number>& numbers) {
  for (const std::string& text : texts) {
    Number value{};
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || stop != text.data() + text.size() || !(value > 0)) return false;
    numbers.push_back(value);
  }
  return true;
}

/// KEY=V1,V2,...
std::optional<chart::Wishes> parse_wishes(const ChartOptions& options, DiagnosticSink& sink) {
  chart::Wishes wishes;
  for (const std::string& text : options.vary) {
    const std::size_t equals = text.find('=');
    const std::string key = text.substr(0, equals);
    const std::vector<std::string> values = split(equals == std::string::npos ? "" : text.substr(equals + 1));
    bool is_understood = equals != std::string::npos && equals > 0 &&
                         std::ranges::none_of(values, [](const std::string& v) { return v.empty(); });
    if (is_understood && key == "cells") {
      is_understood = read_numbers(values, wishes.cells);
    } else if (is_understood && key == "step") {
      is_understood = read_numbers(values, wishes.steps);
    } else if (is_understood && key == "fraction") {
      is_understood = read_numbers(values, wishes.fractions);
    } else if (is_understood) {
      wishes.method[key] = values;
    }
    if (is_understood) continue;
    sink.report("bad-option", {}, {fmt::format("--vary {} is no list of values", text)},
                "as in --vary advect=central2,upwind3 --vary cells=32,64,128 --vary step=0.01,0.005");
    return std::nullopt;
  }
  return wishes;
}

class Chart {
 public:
  Chart(Job& job, const ChartOptions& options)
      : job_(job), options_(options), progress_(options.progress, options.quiet || options.json) {}

  Json operator()();

 private:
  bool prepare();
  void run_entries(std::vector<chart::Entry> entries);
  chart::Point run_entry(chart::Entry entry);

  Job& job_;
  const ChartOptions& options_;
  Progress progress_;
  chart::PointOptions point_options_;
  std::unique_ptr<driver::Session> scene_;
  chart::Reference reference_;
  ChartFile file_;
};

bool Chart::prepare() {
  std::optional<driver::CompileOptions> compile = job_.compile_options();
  if (!compile) return false;
  compile->without_task = true;
  point_options_.compile = *compile;
  point_options_.threads = thread_count(options_);
  point_options_.samples = options_.samples;
  point_options_.sample_seconds = options_.sample_seconds;
  point_options_.stop = &interrupt_flag();
  const Preparing preparing(job_);
  std::optional<driver::Compiled> compiled = driver::compile(job_.source(), *compile, job_.sink());
  if (!compiled) return false;
  if (!compiled->problem) {
    job_.sink().report("nothing-to-do", {}, {"the file has no scene to chart"}, "add: scene NAME : MODEL { ... }");
    return false;
  }
  driver::SessionOptions session;
  session.threads = point_options_.threads;
  scene_ = driver::Session::open(job_.source(), std::make_shared<driver::Compiled>(std::move(*compiled)), session,
                                 job_.sink());
  return scene_ != nullptr;
}

chart::Point Chart::run_entry(chart::Entry entry) {
  std::string why;
  if (entry.fraction > 0 && !chart::choose_step(job_.source(), point_options_, scene_->problem(), entry, why)) {
    chart::Point point;
    point.variant = entry.variant;
    point.failure = why;
    point.is_unstable = why == "unstable at every step";
    point.does_not_fit = !point.is_unstable;
    return point;
  }
  const std::string key = file_.key_of(job_.source(), entry.variant, point_options_.threads);
  if (std::optional<chart::Point> known = file_.find(key)) {
    known->variant = entry.variant;
    return *known;
  }
  chart::Point point = chart::run_point(job_.source(), point_options_, entry.variant, reference_);
  if (!interrupt_flag().load()) file_.add(key, point);
  return point;
}

void Chart::run_entries(std::vector<chart::Entry> entries) {
  std::vector<chart::Point> points;
  for (chart::Entry& entry : entries) {
    const auto done = static_cast<int>(points.size());
    const std::string what = chart::method_text(entry.variant);
    progress_.show(what, done, static_cast<int>(entries.size()));
    chart::Point point = run_entry(std::move(entry));
    if (interrupt_flag().load()) break;
    points.push_back(std::move(point));
    if (!options_.out.empty()) file_.save(job_.sink());
  }
  chart::mark_pareto(points);
  file_.set_points(std::move(points));
}

Json Chart::operator()() {
  Json result = Json::object();
  const std::optional<chart::Wishes> wishes = parse_wishes(options_, job_.sink());
  if (!wishes || !prepare_out(job_) || !prepare()) return result;
  if (!options_.out.empty() && !file_.open(options_.out, scene_->problem().scene, options_.resume, job_.sink()))
    return result;
  const model::Problem& problem = scene_->problem();
  const std::vector<chart::Entry> entries = chart::entries_of(problem, *wishes);
  const bool is_exact =
      std::ranges::any_of(problem.states, [](const model::State& state) { return state.exact.has_value(); });
  if (!is_exact) {
    progress_.show("the reference", 0, static_cast<int>(entries.size()));
    std::string why;
    std::optional<chart::Reference> found = chart::make_reference(job_.source(), point_options_, problem, entries, why);
    if (interrupt_flag().load()) return result;
    if (!found) {
      job_.sink().report("no-reference", job_.place(), {problem.scene, why},
                         "give it an exact solution: exact u = ...");
      return result;
    }
    reference_ = std::move(*found);
  }
  run_entries(entries);
  if (interrupt_flag().load())
    job_.sink().report("run-failed", {}, {"stopped before all points were run; the chart is of those that were"},
                       options_.out.empty() ? "" : "the same command with --resume goes on from here");
  write_chart(job_, problem, file_.points(), reference_, point_options_.threads, result);
  return result;
}

}  // namespace

void add_chart(CLI::App& app, int& status) {
  const auto options = std::make_shared<ChartOptions>();
  CLI::App* verb =
      app.add_subcommand("chart", "speed against accuracy: error against time for methods, cells and steps");
  add_common_options(*verb, *options);
  verb->add_option("--vary", options->vary,
                   "values of a key of --set; also cells, step, and fraction: parts of the largest stable step")
      ->type_name("KEY=V1,V2,...")
      ->allow_extra_args(false);
  verb->add_option("--samples", options->samples, "timings of each point; the median counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  verb->add_option("--sample-seconds", options->sample_seconds, "least duration of each")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  verb->add_flag("--progress", options->progress, "show progress although standard error is no terminal");
  verb->add_flag("--resume", options->resume, "take over the points that --out holds already");
  verb->footer(
      "Examples:\n  dpde chart advection.dpde ring --out results\n  dpde chart burgers.dpde ends --vary "
      "advect=central2,central4,upwind3 --vary time=ssp_rk3,rk4 --vary cells=64,128,256\n  dpde chart heat.dpde rod "
      "--vary real=f32,f64 --vary fraction=0.9,0.3 --json\n\nThe error is that at the end of the scene, against its "
      "exact "
      "solution or else a finer run.");
  on_call(*verb, status, [options] {
    Job job(*options);
    Json result = Json::object();
    guarded(job, [&] {
      if (job.load_source()) result = Chart(job, *options)();
    });
    return job.finish(std::move(result));
  });
}

}  // namespace dpde::tools
