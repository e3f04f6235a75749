// SPDX-License-Identifier: Apache-2.0
// dpde stability: tests the stability verdict. Runs below and above the predicted limit, with and without a random
// disturbance, and draws the predicted and the measured limit in one picture.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "command.h"
#include "interrupt.h"
#include "plot/text_plot.h"
#include "preparing.h"
#include "progress.h"
#include "report/scene/verdict.h"
#include "scene_output.h"
#include "scene_session.h"
#include "stability/frozen/frozen_points.h"
#include "stability/trial.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

using stability::StabilityReport;
using stability::StepLimit;

struct StabilityOptions : CommonOptions {
  std::string against;
  int points = 9, steps = 0;
  bool progress = false;
};

constexpr double factors[] = {0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 1.02, 1.05, 1.1, 1.2, 1.5};
constexpr double precision = 2e-3;  // of measured limits, relative
constexpr double range = 8;         // factor around the prediction

/// NAME=LOW..HIGH with a number of values; with equal ratios if they are positive and far apart.
struct Sweep {
  std::string name;
  std::vector<double> values;
  bool is_log = false;
};

std::optional<Sweep> parse_sweep(const StabilityOptions& options, DiagnosticSink& sink) {
  const std::string& text = options.against;
  const std::size_t equals = text.find('='), dots = text.find("..");
  double low = 0, high = 0;
  const auto number = [&](std::size_t begin, std::size_t end, double& value) {
    const auto [stop, error] = std::from_chars(text.data() + begin, text.data() + end, value);
    return error == std::errc() && stop == text.data() + end && std::isfinite(value);
  };
  const bool is_understood = equals != std::string::npos && equals > 0 && dots != std::string::npos && dots > equals &&
                             number(equals + 1, dots, low) && number(dots + 2, text.size(), high) && low < high;
  if (!is_understood) {
    sink.report("bad-option", {}, {fmt::format("--against {} is no range", text)},
                "a parameter and its range, as in --against nu=0.001..0.1");
    return std::nullopt;
  }
  Sweep sweep{text.substr(0, equals), {}, low > 0 && high >= 8 * low};
  for (int i = 0; i < options.points; ++i) {
    const double part = static_cast<double>(i) / (options.points - 1);
    sweep.values.push_back(sweep.is_log ? low * std::pow(high / low, part) : low + part * (high - low));
    if (sweep.name == "cells" || sweep.name.starts_with("cells."))
      sweep.values.back() = std::round(sweep.values.back());
  }
  const auto [first, last] = std::ranges::unique(sweep.values);
  sweep.values.erase(first, last);
  return sweep;
}

class Stability {
 public:
  Stability(Job& job, const StabilityOptions& options)
      : job_(job), options_(options), progress_(options.streams.err, options.progress, options.quiet || options.json) {}

  Json operator()();

 private:
  std::unique_ptr<driver::Session> open(DiagnosticSink& sink, const std::map<std::string, std::string>& overrides = {});
  stability::TrialOptions trial_options(driver::Session& session, const StabilityReport& verdict) const;
  stability::Search search(driver::Session& session, const StabilityReport& verdict);
  void scan_step(Json& result);
  void scan_step_of(driver::Session& session, const StabilityReport& verdict, double limit, Json& result);
  void measure_growth(driver::Session& session, const StabilityReport& verdict, Json& result);
  void scan_against(const Sweep& sweep, Json& result);
  bool scan_value(const Sweep& sweep, double value, Json& rows, Json& result);
  void draw_growths(driver::Session& session, const StabilityReport& verdict,
                    const std::vector<stability::Trial>& trials);
  void draw_limits(const Sweep& sweep, const Json& rows, const Json& points);
  void save_points(const Json& points);
  void tell_stop();

  Job& job_;
  const StabilityOptions& options_;
  Progress progress_;
  bool has_rows_ = false;  // rows of a scan over a parameter exist
};

std::unique_ptr<driver::Session> Stability::open(DiagnosticSink& sink,
                                                 const std::map<std::string, std::string>& overrides) {
  std::optional<Preparing> preparing;  // Preparing may end the process: not once there are rows
  if (!has_rows_) preparing.emplace(job_);
  std::optional<driver::CompileOptions> compile_options = job_.compile_options();
  if (!compile_options) return nullptr;
  for (const auto& [key, value] : overrides) compile_options->selection.overrides[key] = value;
  compile_options->runs = driver::any_number_of_runs;  // as many as it takes to see growth or not
  return open_scene(job_, *std::move(compile_options), sink);
}

stability::TrialOptions Stability::trial_options(driver::Session& session, const StabilityReport& verdict) const {
  stability::TrialOptions trial{options_.steps, options_.seed};
  trial.growth_rate = verdict.group_growth_rate;
  trial.group = verdict.group;
  trial.growth_by_events = verdict.group_growth_by_events;
  trial.largest_rate = verdict.growth_rate;
  trial.stop = &interrupt_flag();
  if (stability::varies_in_time(session)) trial.most_time = session.steps() * session.problem().step;
  return trial;
}

stability::Search Stability::search(driver::Session& session, const StabilityReport& verdict) {
  const bool has_limit = verdict.is_analysed() && verdict.limit.kind == StepLimit::Kind::limit;
  const double guess = has_limit ? verdict.limit.step : session.problem().step;
  int runs = 0;
  return stability::search_limit(
      session, guess, precision, has_limit ? range : 1e3, trial_options(session, verdict),
      [&](const stability::Trial& trial) {
        progress_.show(fmt::format("step {:.5g}: {}", trial.step, trial.is_stable ? "stable" : "unstable"),
                       std::min(++runs, 12), 12);
      });
}

void Stability::tell_stop() {
  if (interrupt_flag().load())
    job_.sink().report("run-failed", {}, {"stopped before all runs were made; what is told is of those that were"});
}

Json points_of(const std::vector<stability::Trial>& trials, const std::vector<double>& predicted) {
  Json points = Json::array();
  for (std::size_t i = 0; i < trials.size(); ++i) {
    points.push_back({{"step", trials[i].step},
                      {"stable", trials[i].is_stable},
                      {"growth", json_number(trials[i].growth)},
                      {"predicted_growth", json_number(predicted[i])},
                      {"steps", trials[i].steps}});
  }
  return points;
}

void Stability::draw_growths(driver::Session& session, const StabilityReport& verdict,
                             const std::vector<stability::Trial>& trials) {
  if (trials.empty()) return;
  plot::LinePanel panel{fmt::format("{}: growth of a disturbance", session.problem().scene),
                        "step",
                        "largest factor a step",
                        false,
                        false,
                        {},
                        {}};
  plot::Curve predicted{"predicted", {}, {}}, stable{"measured, stable", {}, {}, true},
      unstable{"measured, unstable", {}, {}, true};
  const double low = trials.front().step, high = trials.back().step;
  const int parts = verdict.is_of_grid ? 20 : 100;  // each point computes the eigenvalues of a large matrix if of_grid
  for (int i = 0; i <= parts; ++i) predicted.x.push_back(low + (high - low) * i / parts);
  predicted.y = stability::growths_at(session, verdict, predicted.x);
  for (const stability::Trial& trial : trials) {
    if (!std::isfinite(trial.growth)) continue;
    plot::Curve& curve = trial.is_stable ? stable : unstable;
    curve.x.push_back(trial.step);
    curve.y.push_back(trial.growth);
  }
  for (plot::Curve* curve : {&predicted, &stable, &unstable}) {
    panel.log_y = panel.log_y || std::ranges::any_of(curve->y, [](double y) { return y > 30; });
    if (!curve->x.empty()) panel.curves.push_back(*curve);
  }
  if (!options_.quiet && !options_.json) job_.say(plot::text_plot(panel, plot::terminal_is_utf8()));
  save_picture(job_, session.problem().scene + "_stability", {panel});
}

/// The time at which the runs with the shortest steps blow up, if it is nearly the same for all of them.
std::optional<double> common_end(const std::vector<stability::Trial>& by_step) {
  constexpr std::size_t looked_at = 4;
  constexpr double alike = 1.25;
  if (by_step.size() < looked_at) return std::nullopt;
  double first = std::numeric_limits<double>::infinity(), last = 0;
  for (std::size_t i = 0; i < looked_at; ++i) {
    first = std::min(first, by_step[i].step * by_step[i].steps);
    last = std::max(last, by_step[i].step * by_step[i].steps);
  }
  return last < alike * first ? std::optional(first) : std::nullopt;
}

void Stability::scan_step_of(driver::Session& session, const StabilityReport& verdict, double limit, Json& result) {
  stability::Search found = search(session, verdict);
  const stability::TrialOptions options = trial_options(session, verdict);
  for (const double factor : factors) {
    if (found.was_stopped) break;
    const auto trial = stability::try_step(session, factor * limit, options);
    if (trial) found.trials.push_back(*trial);
  }
  std::ranges::sort(found.trials, {}, &stability::Trial::step);
  std::vector<double> steps;
  for (const stability::Trial& trial : found.trials) steps.push_back(trial.step);
  result["points"] = points_of(found.trials, stability::growths_at(session, verdict, steps));
  const bool is_found = found.largest > 0 && found.smallest_unstable > 0;
  result["measured"] = {{"max_step", is_found ? Json(found.largest) : Json(nullptr)},
                        {"smallest_unstable", is_found ? Json(found.smallest_unstable) : Json(nullptr)}};
  if (is_found) {
    result["ratio"] = found.largest / limit;
    std::string beside;
    if (verdict.is_analysed() && verdict.limit.kind == StepLimit::Kind::limit)
      beside = fmt::format(", {:.4f} times what is predicted", found.largest / limit);
    if (verdict.is_analysed() && verdict.limit.kind == StepLimit::Kind::none)
      beside = ", though none is predicted: what runs show counts";
    job_.say(fmt::format("measured: stable up to a step of {:.6g}, unstable from {:.6g}{}\n", found.largest,
                         found.smallest_unstable, beside));
  } else if (!found.was_stopped) {
    job_.say(fmt::format("measured: no {} step between {:.4g} and {:.4g}\n", found.largest > 0 ? "unstable" : "stable",
                         steps.empty() ? 0 : steps.front(), steps.empty() ? 0 : steps.back()));
    const std::optional<double> end = found.largest > 0 ? std::nullopt : common_end(found.trials);
    if (end) {
      result["measured"]["all_end_after"] = *end;
      job_.say(fmt::format(
          "  all end about {:.3g} after the scene's start, whatever the step: what the run has become by then is no\n"
          "  matter of the step. The equations blow up, or make something too steep for these cells (dpde run says "
          "where)\n",
          *end));
    }
  }
  draw_growths(session, verdict, found.trials);
}

/// If no step is stable, growth rates are compared.
void Stability::measure_growth(driver::Session& session, const StabilityReport& verdict, Json& result) {
  std::vector<stability::Trial> trials;
  std::vector<double> steps;
  for (const double factor : {0.25, 0.5, 1.0}) {
    const auto trial = stability::try_step(session, factor * verdict.step, trial_options(session, verdict));
    if (!trial) break;
    trials.push_back(*trial);
    steps.push_back(trial->step);
  }
  const std::vector<double> predicted = stability::growths_at(session, verdict, steps);
  result["points"] = points_of(trials, predicted);
  for (std::size_t i = 0; i < trials.size(); ++i) {
    job_.say(fmt::format(
        "measured at a step of {:.5g}: {} after {} steps, a factor of {:.7g} a step (predicted {:.7g})\n", steps[i],
        trials[i].is_stable ? "stable" : "unstable", trials[i].steps, trials[i].growth, predicted[i]));
  }
  if (trials.size() == 3) {
    result["measured"] = {{"max_step", trials[0].is_stable ? Json(steps[0]) : Json(0)}, {"growth", trials[2].growth}};
    result["ratio"] = nullptr;  // there is no limit; compare the growth rates
  }
}

void Stability::scan_step(Json& result) {
  const std::unique_ptr<driver::Session> session = open(job_.sink());
  if (session == nullptr) return;
  result["scene"] = session->problem().scene;
  const StabilityReport verdict = stability::verdict_of(*session);
  report::Report report = report::verdict_report(session->problem(), verdict, job_.source());
  result["predicted"] = std::move(report.json);
  tell(job_, report);
  const bool is_limited = verdict.is_analysed() && verdict.limit.kind == StepLimit::Kind::limit;
  if (verdict.is_analysed() && verdict.limit.kind == StepLimit::Kind::never) {
    measure_growth(*session, verdict, result);
  } else {
    scan_step_of(*session, verdict, is_limited ? verdict.limit.step : session->problem().step, result);
    if (!is_limited) result["ratio"] = nullptr;
  }
  save_points(result["points"]);
}

/// A value that cannot be run becomes a row with the reason. Returns false when stopped.
bool Stability::scan_value(const Sweep& sweep, double value, Json& rows, Json& result) {
  DiagnosticSink sink;
  Json row = {{sweep.name, value}, {"predicted", nullptr}, {"measured", nullptr}, {"ratio", nullptr}};
  const std::unique_ptr<driver::Session> session = open(sink, {{sweep.name, fmt::format("{}", value)}});
  if (interrupt_flag().load()) return false;
  if (session == nullptr) {
    const auto error =
        std::ranges::find(sink.all(), Severity::error, [](const Diagnostic& d) { return d.kind->severity; });
    row["failure"] = error == sink.all().end() ? "it cannot be run" : error->message;
    job_.say(fmt::format("{} = {:.5g}: left out: {}\n", sweep.name, value, row["failure"].get<std::string>()));
    rows.push_back(row);
    return true;
  }
  result["scene"] = session->problem().scene;
  const StabilityReport verdict = stability::verdict_of(*session);
  const bool has_limit = verdict.is_analysed() && verdict.limit.kind == StepLimit::Kind::limit;
  const stability::Search found = search(*session, verdict);
  if (found.was_stopped) return false;
  const bool is_found = found.largest > 0 && found.smallest_unstable > 0;
  if (has_limit) row["predicted"] = verdict.limit.step;
  if (is_found) row["measured"] = found.largest;
  if (has_limit && is_found) row["ratio"] = found.largest / verdict.limit.step;
  rows.push_back(row);
  for (const stability::Trial& trial : found.trials)
    result["points"].push_back({{sweep.name, value},
                                {"step", trial.step},
                                {"stable", trial.is_stable},
                                {"growth", json_number(trial.growth)},
                                {"steps", trial.steps}});
  job_.say(fmt::format("{} = {:.5g}: predicted {}, measured {}, ratio {}\n", sweep.name, value,
                       has_limit ? fmt::format("{:.5g}", verdict.limit.step)
                       : verdict.is_analysed() && verdict.limit.kind == StepLimit::Kind::never
                           ? "that no step is stable"
                           : "no limit",
                       is_found            ? fmt::format("{:.5g}", found.largest)
                       : found.largest > 0 ? fmt::format("none up to {:.5g}", found.largest)
                                           : "no stable step",
                       has_limit && is_found ? fmt::format("{:.4f}", found.largest / verdict.limit.step) : "-"));
  return true;
}

void Stability::scan_against(const Sweep& sweep, Json& result) {
  DiagnosticSink first;
  open(first, {{sweep.name, fmt::format("{}", sweep.values.front())}});
  for (const Diagnostic& d : first.all()) {
    if (d.kind == KindRef("unknown-setting").kind) return job_.sink().add(d);  // it would be the same for all values
  }
  Json rows = Json::array();
  result["points"] = Json::array();
  for (std::size_t i = 0; i < sweep.values.size() && !interrupt_flag().load(); ++i) {
    if (!scan_value(sweep, sweep.values[i], rows, result)) break;
    has_rows_ = true;
    progress_.show(fmt::format("{} = {:.5g}", sweep.name, sweep.values[i]), static_cast<int>(i) + 1, options_.points);
  }
  const bool is_any_run = std::ranges::any_of(rows, [](const Json& row) { return !row.contains("failure"); });
  // reports the error
  if (!is_any_run && !rows.empty()) open(job_.sink(), {{sweep.name, fmt::format("{}", sweep.values.front())}});
  result["predicted"] = Json::array();
  result["measured"] = Json::array();
  result["ratio"] = Json::array();
  for (const Json& row : rows) {
    for (const char* key : {"predicted", "measured", "ratio"}) result[key].push_back(row[key]);
  }
  result["against"] = {{"name", sweep.name}, {"rows", rows}};
  draw_limits(sweep, rows, result["points"]);
  save_points(result["points"]);
}

void Stability::draw_limits(const Sweep& sweep, const Json& rows, const Json& points) {
  plot::LinePanel panel{"largest stable step", sweep.name, "step", sweep.is_log, true, {}, {}};
  plot::Curve predicted{"predicted", {}, {}}, measured{"measured", {}, {}, true}, stable{"stable runs", {}, {}, true},
      unstable{"unstable runs", {}, {}, true};
  measured.symbol = plot::Symbol::ring;
  unstable.symbol = plot::Symbol::cross;
  for (const Json& row : rows) {
    if (!row["predicted"].is_null()) {
      predicted.x.push_back(row[sweep.name]);
      predicted.y.push_back(row["predicted"]);
    }
    if (!row["measured"].is_null()) {
      measured.x.push_back(row[sweep.name]);
      measured.y.push_back(row["measured"]);
    }
  }
  for (const Json& point : points) {
    plot::Curve& curve = point["stable"].get<bool>() ? stable : unstable;
    curve.x.push_back(point[sweep.name]);
    curve.y.push_back(point["step"]);
  }
  for (plot::Curve* curve : {&predicted, &measured, &stable, &unstable}) {
    if (!curve->x.empty()) panel.curves.push_back(*curve);
  }
  if (panel.curves.empty()) return;
  save_picture(job_, "stability_against_" + sweep.name, {panel});
}

void Stability::save_points(const Json& points) {
  if (options_.out.empty() || points.empty()) return;
  std::string table, header;
  for (const auto& [key, value] : points[0].items()) header += (header.empty() ? "" : ",") + key;
  for (const Json& point : points) {
    std::string line;
    for (const auto& [key, value] : point.items()) {
      const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
      line += (line.empty() ? "" : ",") + text;
    }
    table += "\n" + line;
  }
  save_text(job_, "stability.csv", header + table + "\n");
}

Json Stability::operator()() {
  Json result = Json::object();
  if (!job_.load_source() || !prepare_out(job_)) return result;
  if (options_.against.empty()) {
    scan_step(result);
  } else if (const std::optional<Sweep> sweep = parse_sweep(options_, job_.sink())) {
    scan_against(*sweep, result);
  }
  if (!job_.failed()) tell_stop();
  result["files"] = job_.files();
  return result;
}

}  // namespace

void add_stability(CLI::App& app, Console& console) {
  const auto options = std::make_shared<StabilityOptions>();
  CLI::App* verb = app.add_subcommand("stability", "prove the largest stable step by runs below and above it");
  add_common_options(*verb, *options, console);
  verb->add_option("--against", options->against, "repeat it for values of a parameter or key of --set")
      ->type_name("NAME=LOW..HIGH");
  verb->add_option("--points", options->points, "values of that")->check(CLI::Range(2, 1000))->capture_default_str();
  verb->add_option("--steps", options->steps,
                   "steps of each run (default: 500 to 100000, as cells allow; to 4000 with solves)")
      ->check(CLI::Range(100, 100'000'000));
  verb->add_flag("--progress", options->progress, "show progress although standard error is no terminal");
  verb->footer(
      "Examples:\n  dpde stability heat.dpde plate\n  dpde stability heat.dpde plate --set cells=32 --set time=rk4 "
      "--out "
      "results\n  dpde stability burgers.dpde ends --against nu=0.001..0.1 --out results\n\nA run is unstable where a "
      "random disturbance of 1e-6 grows faster than twice what the equations do.");
  on_call(*verb, console, [options] { return call(*options, [&](Job& job) { return Stability(job, *options)(); }); });
}

}  // namespace dpde::tools
