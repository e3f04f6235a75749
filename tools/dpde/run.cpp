// SPDX-License-Identifier: Apache-2.0
// dpde run: steps a scene through time.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "analysis/run/conserved_sums.h"
#include "command.h"
#include "data_set.h"
#include "driver/report/back_flow.h"
#include "driver/report/blow_up.h"
#include "driver/report/checkerboard_mode.h"
#include "driver/report/missed_constraints.h"
#include "driver/report/run_description.h"
#include "interrupt.h"
#include "netcdf_output.h"
#include "plot/run_panels.h"
#include "plot/scene_panels.h"
#include "plot/text_plot.h"
#include "preparing.h"
#include "progress.h"
#include "record.h"
#include "report/scene/solves.h"
#include "run_checkpoint.h"
#include "scene_output.h"
#include "scene_session.h"
#include "stability/stability_report.h"
#include "support/maths/evaluate.h"
#include "support/names/number_text.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

constexpr int looks_at_sums = 4;       // in a run, in addition to the first one
constexpr int points_of_course = 512;  // of the curves of a run with one cell

struct RunOptions : CommonOptions {
  int every = 0;
  bool progress = false, resume = false, centres = false;
  std::string checkpoint_every;
};

class Run {
 public:
  Run(Job& job, const RunOptions& options) : job_(job), options_(options) {}

  Json operator()();

 private:
  bool check_options();
  bool open();
  bool prepare_checkpoints();
  void look_at_start();
  Observer observer(Progress& progress);
  bool step();
  void report(Json& result);
  void report_constraints(Json& result);
  void report_solves(Json& result);
  void report_errors(Json& result);
  void report_drifts(Json& result);
  void warn_of_number(const std::string& name, double value);
  void write_files();
  std::map<std::string, std::vector<double>> shown_at_end();
  void write_series(const RunDescription& run, const Series& series);
  void show_curve();
  bool is_one_cell() const { return session_->workspace().cell_count() == 1; }
  void add_to_course(double t, const std::vector<void*>& states);

  Job& job_;
  const RunOptions& options_;
  std::unique_ptr<driver::Session> session_;
  RunResult outcome_;
  std::optional<FrameFile> frames_;  // only with --out
  std::unique_ptr<Record> record_;
  std::unique_ptr<analysis::SumMonitor> sums_;  // sums that single steps conserve
  std::unique_ptr<driver::BackFlowWatch> back_flow_;
  CheckpointInterval interval_;
  std::unique_ptr<RunCheckpoint> checkpoint_;  // only with --out
  int first_step_ = 0;
  std::vector<plot::Curve> course_;        // for one cell: its states over time
  Json misses_at_start_ = Json::object();  // by the field that the first step changes
};

Json Run::operator()() {
  Json result = Json::object();
  if (!open()) return result;
  if (!options_.out.empty()) frames_.emplace(RunCheckpoint::path_of(job_, *session_));
  record_ = std::make_unique<Record>(*session_, options_.every, frames_ ? &*frames_ : nullptr);
  sums_ = std::make_unique<analysis::SumMonitor>(*session_,
                                                 analysis::conserved_sums(job_.source(), session_->shared_compiled())
                                                     .value_or(std::vector<analysis::ConservedSum>{}));
  back_flow_ = std::make_unique<driver::BackFlowWatch>(*session_);
  if (!prepare_checkpoints()) return result;
  if (first_step_ == 0) look_at_start();
  if (!step()) return result;
  if (!outcome_.blow_up) {
    driver::report_instabilities(*session_, job_.sink(), stability::advice_on_blow_up);
    driver::report_chessboards(*session_, job_.sink());
  }
  report(result);
  show_curve();
  write_files();
  result["files"] = job_.files();
  return result;
}

bool Run::check_options() {
  const bool wanted = options_.resume || !options_.checkpoint_every.empty();
  const std::optional<CheckpointInterval> interval = parse_interval(options_.checkpoint_every);
  if (wanted && options_.out.empty()) {
    job_.sink().report("bad-option", {}, {"--resume and --checkpoint-every need the --out DIR of the run"});
  } else if (!options_.checkpoint_every.empty() && !interval) {
    job_.sink().report("bad-option", {},
                       {fmt::format("--checkpoint-every {} is no interval", options_.checkpoint_every)},
                       "a number of steps such as 500, or a time such as 30s, 10min or 2h");
  }
  interval_ = interval.value_or(CheckpointInterval{});
  return !job_.failed();
}

bool Run::prepare_checkpoints() {
  if (options_.out.empty()) return true;
  checkpoint_ = std::make_unique<RunCheckpoint>(job_, *session_, *record_, *frames_, interval_);
  if (!options_.resume) return true;
  const std::optional<int> step = checkpoint_->resume();
  first_step_ = step.value_or(0);
  return step.has_value();
}

bool Run::open() {
  if (!check_options() || !prepare_out(job_)) return false;
  const Preparing preparing(job_);
  session_ = open_scene(job_, job_.sink());
  const stability::Look look{false,
                             shown_in_line(options_.streams.err, options_.progress, options_.quiet || options_.json)};
  return session_ != nullptr && stability::check_step(*session_, options_.force, job_.sink(), look) &&
         has_finite_exact(*session_, job_.sink());
}

/// An observer whose interval fits the record, checkpoints and the progress line.
Observer Run::observer(Progress& progress) {
  Observer observer;
  observer.every = std::gcd(record_->kept().interval(), interval_.steps);
  if (interval_.seconds > 0) observer.every = 1;  // to check the clock
  const int looks = is_one_cell() ? points_of_course : progress.active() ? 100 : looks_at_sums;
  if (observer.every == 0) observer.every = std::max(1, session_->steps() / looks);
  observer.call = [this, &progress, next = 0](const Snapshot& snapshot) mutable {
    if (is_one_cell()) add_to_course(snapshot.t, snapshot.states);
    if (snapshot.step >= next || snapshot.is_last) {
      sums_->look(snapshot.step, snapshot.t, snapshot.states);
      back_flow_->look(snapshot.t, snapshot.states);
      next = snapshot.step + std::max(1, session_->steps() / looks_at_sums);
    }
    progress.show(fmt::format("step {} of {}  t = {:.6g}", snapshot.step, session_->steps(), snapshot.t), snapshot.step,
                  session_->steps());
    record_->look(snapshot);
    if (checkpoint_) checkpoint_->look(snapshot);
  };
  return observer;
}

/// Ordinary differential equations have no picture in space.
void Run::add_to_course(double t, const std::vector<void*>& states) {
  course_.resize(states.size());
  for (std::size_t s = 0; s < states.size(); ++s) {
    plot::Curve& curve = course_[s];
    if (!curve.x.empty() && !(t > curve.x.back())) continue;
    double value = 0;
    copy_out(session_->workspace().layout(), states[s], {&value, 1});
    curve.title = session_->rollout().state_name(static_cast<int>(s));
    curve.x.push_back(t);
    curve.y.push_back(value);
  }
}

bool Run::step() {
  Progress progress(options_.streams.err, options_.progress, options_.quiet || options_.json);
  if (!guarded(job_, [&] { outcome_ = session_->rollout().run(observer(progress), first_step_); })) return false;
  const std::vector<void*>& states = session_->rollout().final_states();
  const bool keeps = outcome_.stopped || options_.resume || !options_.checkpoint_every.empty();
  // Resuming a steady run would make one more step: so no checkpoint is saved at its end, and it resumes from an
  // earlier one.
  const bool is_steady = outcome_.steady && outcome_.steady->is_reached;
  if (checkpoint_ && keeps && !outcome_.blow_up && !is_steady) checkpoint_->save(outcome_.steps_done, states);
  record_->look_at_end(outcome_.steps_done, states);
  if (!record_->kept().failure().empty() && !job_.failed())
    job_.sink().report("machine-failed", {}, {record_->kept().failure()});
  if (is_one_cell()) add_to_course(session_->time_of(outcome_.steps_done), states);
  back_flow_->look(session_->time_of(outcome_.steps_done), states);
  back_flow_->report(job_.sink());
  if (outcome_.blow_up)
    driver::report_blow_up(*session_, *outcome_.blow_up, job_.sink(), stability::advice_on_blow_up(*session_));
  driver::report_not_steady(*session_, outcome_, job_.sink());
  if (outcome_.stopped) {
    job_.sink().report("interrupted", {},
                       {fmt::format("{}", outcome_.steps_done), fmt::format("{}", session_->steps()),
                        fmt::format("{:.6g}", session_->time_of(outcome_.steps_done))},
                       checkpoint_ ? "the same command with --resume goes on from here" : "");
  }
  return true;
}

void Run::report(Json& result) {
  const double time = session_->time_of(outcome_.steps_done);
  const double points = double(session_->workspace().cell_count()) * double(outcome_.parts);
  const double rate = outcome_.seconds > 0 ? points / outcome_.seconds : 0;
  result["scene"] = session_->problem().scene;
  result["cells"] = json_cells(*session_);
  result["steps"] = outcome_.steps_done;
  const model::Problem& problem = session_->problem();
  if (problem.has_parts()) result["parts"] = outcome_.parts;
  if (problem.substeps.control) result["refused"] = outcome_.refused;
  if (outcome_.steady)
    result["steady"] = {{"reached", outcome_.steady->is_reached}, {"change", json_number(outcome_.steady->change)}};
  result["resumed_steps"] = first_step_;
  result["time"] = json_number(time);
  if (!problem.remarks.units.empty()) result["units"] = problem.remarks.units;
  result["wall_s"] = outcome_.seconds;
  result["compile_s"] = session_->compiled().seconds;
  result["code_from_cache"] = session_->compiled().cached.is_from_cache;
  result["points_per_s"] = rate;
  job_.say(fmt::format("{}: {} cells, {} steps to {} in {} ({} points/s), compiled in {}\n", problem.scene,
                       cells_text(*session_), outcome_.steps_done, plot::time_text(problem, time),
                       human_seconds(outcome_.seconds), human_count(rate),
                       human_seconds(session_->compiled().seconds)));
  if (problem.substeps.control)
    job_.say(fmt::format("tolerance {}: {} parts of steps made, {} refused\n", problem.substeps.control->relative,
                         outcome_.parts, outcome_.refused));
  if (outcome_.steady && outcome_.steady->is_reached)
    job_.say(fmt::format("steady at t = {:.6g}: the state changes by {:.3g} a unit of time\n", time,
                         outcome_.steady->change));
  Json observables = Json::object();
  for (const auto& [name, value] : record_->kept().series()[0].observables.back()) {
    observables[name] = json_number(value);
    warn_of_number(name, value);
    job_.say(fmt::format("{} = {:.12g}{}\n", name, shown(value), behind_number(problem.unit_of(name))));
  }
  for (auto& [name, value] : observables.items()) {
    if (options_.every <= 0) break;
    Json series = Json::array();
    for (const auto& row : record_->kept().series()[0].observables) {
      for (const auto& [key, number] : row) {
        if (key == name) series.push_back(json_number(number));
      }
    }
    value = std::move(series);
  }
  result["observables"] = std::move(observables);
  report_constraints(result);
  report_solves(result);
  report_errors(result);
  report_drifts(result);
}

void Run::warn_of_number(const std::string& name, double value) {
  if (std::isfinite(value) || outcome_.blow_up) return;
  const auto& observables = session_->problem().observables;
  const auto found = std::ranges::find(observables, name, &model::Quantity::name);
  job_.sink().report(
      "observable-not-finite", found->origin.range, {name, fmt::format("{}", shown(value))},
      "the states are finite: the observable divides by 0, or takes a root or log of a number that has none");
}

/// Drift of sums that single steps conserve; events and controls may change these later.
void Run::report_drifts(Json& result) {
  Json drifts = Json::object();
  std::string text;
  const model::Problem& problem = session_->problem();
  const bool is_forced = !problem.events.empty() || !problem.controls.empty();
  for (const analysis::SumDrift& drift : sums_->drifts()) {
    drifts[drift.name] = {{"begin", json_number(drift.begin)},       {"end", json_number(drift.end)},
                          {"per_time", json_number(drift.per_time)}, {"relative", json_number(drift.largest)},
                          {"but_for_steps", drift.but_for_steps},    {"until_switched", drift.until_switched}};
    text +=
        fmt::format("{} {} {:.3g}", text.empty() ? "drift a unit of time:" : ",", drift.name, shown(drift.per_time));
    const bool may_change = is_forced || drift.but_for_steps || drift.until_switched;
    if (drift.exceeds_rounding && !may_change && !outcome_.blow_up)
      job_.sink().report("sum-drifts", problem.time_origin.range, {drift.name, fmt::format("{:.3g}", drift.largest)},
                         "single steps from random states keep it: rounding alone would be smaller");
  }
  if (!text.empty()) job_.say(text + "\n");
  result["drift"] = std::move(drifts);
}

void Run::report_errors(Json& result) {
  Json errors = Json::object();
  const double time = session_->time_of(outcome_.steps_done);
  for (const driver::ErrorNorms& norm : session_->errors(time, session_->rollout().final_states())) {
    errors[norm.field] = {{"l1", json_number(norm.l1)}, {"l2", json_number(norm.l2)}, {"linf", json_number(norm.linf)}};
    job_.say(fmt::format("error of {} against the exact solution: l1 {:.4g}, l2 {:.4g}, linf {:.4g}\n", norm.field,
                         norm.l1, norm.l2, norm.linf));
  }
  result["error"] = std::move(errors);
}

/// Reports constraints that the initial state violates; the first step enforces them.
void Run::look_at_start() {
  session_->engine().update_formulas();
  std::vector<void*> states;
  for (int s = 0; s < session_->rollout().state_count(); ++s) states.push_back(session_->rollout().initial(s).base());
  for (const driver::Session::Miss& miss : session_->misses(session_->problem().t_begin, states)) {
    if (!(miss.value > driver::rounding_of_constraints(*session_) * miss.terms)) continue;
    misses_at_start_[miss.multiplier] = json_number(miss.value);
    const bool has_file =
        std::ranges::any_of(session_->problem().states, [](const model::State& s) { return !s.initial.file.empty(); });
    job_.say(fmt::format(
        "the first step changes the initial state: it misses the constraint that gives {} by {:.3g}, of terms of "
        "{:.3g}{}\n",
        miss.multiplier, miss.value, miss.terms,
        has_file ? "" : "; write projected after its formula to begin where it is true"));
  }
}

void Run::report_constraints(Json& result) {
  const double time = session_->time_of(outcome_.steps_done);
  const auto found = session_->misses(time, session_->rollout().final_states());
  Json misses = Json::object();
  for (const driver::Session::Miss& miss : found) misses[miss.multiplier] = json_number(miss.value);
  if (outcome_.steps_done > 0 && !outcome_.blow_up) driver::report_missed_constraints(*session_, found, job_.sink());
  if (!misses.empty()) result["constraints"] = std::move(misses);
  if (!misses_at_start_.empty()) result["constraints_at_start"] = misses_at_start_;
}

/// Reports how equations were solved, and the reasons.
void Run::report_solves(Json& result) {
  const auto solves = driver::solves_of(session_->compiled(), session_->rollout().solve_notes());
  if (solves.empty()) return;
  result["solves"] = report::json_of(solves);
  job_.say(driver::text_of(solves));
  if (!outcome_.blow_up) driver::report_solves(session_->problem(), solves, job_.sink());
}

void Run::write_files() {
  if (options_.out.empty()) return;
  const Rollout& rollout = session_->rollout();
  const std::map<std::string, std::vector<double>> outputs = shown_at_end();
  plot::DrawnRun drawn{.time = session_->time_of(outcome_.steps_done), .course = course_};
  for (int s = 0; s < rollout.state_count(); ++s) {
    drawn.states.push_back(rollout.state_name(s));
    save_state(job_, session_->axes(), rollout.state_name(s), session_->final_state(s));
  }
  for (const auto& [name, values] : outputs) {
    drawn.outputs.push_back(name);
    save_state(job_, session_->axes(), name, values);
  }
  drawn.at_end = [&](const std::string& name) {
    const auto output = outputs.find(name);
    return output != outputs.end() ? output->second : session_->final_state(rollout.state_index(name));
  };
  drawn.at_start = [&](const std::string& name) { return session_->initial(rollout.state_index(name)); };
  const RunDescription run = description_of(job_, *session_, options_.centres);
  const Series& first = record_->kept().series()[0];
  if (options_.every > 0 && record_->kept().keeps_states()) write_series(run, first);
  const model::Problem& problem = session_->problem();
  const std::vector<plot::Panel> observed = plot::panels_of_observables(problem, first);
  if (!observed.empty()) save_picture(job_, problem.scene + "_observables", observed);
  if (record_->kept().keeps_states()) save_netcdf(job_, run, record_->kept());
  save_picture(job_, problem.scene, plot::panels_of_run(*session_, drawn));
}

/// Shown outputs at the end, computed if not recorded.
std::map<std::string, std::vector<double>> Run::shown_at_end() {
  std::map<std::string, std::vector<double>> all;
  for (const model::OutputField& shown : session_->problem().shown) {
    std::optional<std::vector<double>> values = record_->kept().last_state(shown.name);
    if (!values) return session_->shown(session_->time_of(outcome_.steps_done), session_->rollout().final_states());
    all.emplace(shown.name, std::move(*values));
  }
  return all;
}

void Run::write_series(const RunDescription& run, const Series& series) {
  std::vector<std::string> fields = series.fields;
  std::ranges::sort(fields);
  for (const std::string& field : fields) {
    save_file(job_, field + "_over_time.npy",
              [&](const std::filesystem::path& path) { write_states(path, run, record_->kept(), series, field); });
  }
  save_text(job_, "observables.csv", table_of(series));
}

void Run::show_curve() {
  if (session_->axes().size() != 1 || options_.quiet || options_.json) return;
  if (is_one_cell())
    return job_.say(plot::text_plot(plot::panel_of_course(session_->problem(), course_), plot::terminal_is_utf8()));
  plot::LinePanel panel;
  panel.x_label = plot::label_of(session_->problem(), session_->axes()[0].name);
  const Rollout& rollout = session_->rollout();
  for (int s = 0; s < rollout.state_count(); ++s) {
    const std::string& name = rollout.state_name(s);
    const plot::NamedState state{name, session_->final_state(s), driver::placement_of(session_->problem(), name), name};
    panel.curves.push_back(plot::curve_of(*session_, state));
    panel.title += (s > 0 ? ", " : "") + name;
  }
  panel.title += " at " + plot::time_text(session_->problem(), session_->time_of(outcome_.steps_done));
  job_.say(plot::text_plot(panel, plot::terminal_is_utf8()));
}

}  // namespace

void add_run(CLI::App& app, Console& console) {
  const auto options = std::make_shared<RunOptions>();
  CLI::App* verb = app.add_subcommand("run", "step a scene through time, or make a data set");
  add_common_options(*verb, *options, console, {.force = true});
  verb->add_option("--every", options->every, "record observables (and with --out all states) every N steps")
      ->check(positive());
  verb->add_flag("--centres", options->centres, "with --out: what lies on faces also at the centres of the cells");
  verb->add_flag("--progress", options->progress, "show progress although standard error is no terminal");
  verb->add_option("--checkpoint-every", options->checkpoint_every,
                   "with --out: a checkpoint every N steps, or 30s, 10min, 2h")
      ->type_name("N");
  verb->add_flag("--resume", options->resume, "go on with a run that was stopped (needs its --out)");
  verb->footer(
      "Examples:\n  dpde run burgers.dpde\n  dpde run heat.dpde plate --set cells=256 --out results\n"
      "  dpde run burgers.dpde wave --set time=rk4 --set step=1e-3 --json\n  dpde run burgers.dpde train --out data "
      "--resume");
  on_call(*verb, console, [options] {
    Job job(*options);
    Json result;
    guarded(job, [&] {
      if (!job.load_source()) return;
      result = is_data_set(job) ? make_data_set(job, options->resume, options->quiet || options->json)
                                : Run(job, *options)();
    });
    if (result.is_null()) result = Json::object();
    return job.finish(std::move(result));
  });
}

}  // namespace dpde::tools
