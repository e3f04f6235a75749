// SPDX-License-Identifier: Apache-2.0
#include "training/data/data_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numeric>

#include "dpde/runtime/bytes.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/team.h"
#include "driver/memory/cpu_time.h"
#include "driver/report/blow_up.h"
#include "driver/report/solve_report.h"
#include "driver/scene/data.h"
#include "files/weights.h"
#include "model/analyse/placement.h"
#include "model/boundary/metric.h"
#include "stencil/text/print_stencil.h"

namespace dpde::training {

namespace {

constexpr int fewest_cells = 4;     // minimum along an axis of the coarsest grid of an order estimate
constexpr int most_intervals = 16;  // for the residual of a run; without coarsening they cost as much as making the run

double root_of_mean_square(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

std::vector<model::Axis> with_cells(std::vector<model::Axis> axes, int ratio) {
  for (model::Axis& axis : axes) axis.cells /= ratio;
  return axes;
}

/// Compares all faces: stretched axes may have the same ends and differ in between.
bool are_same_places(const model::Axis& a, const model::Axis& b) {
  if (a.cells != b.cells) return false;
  for (int i = 0; i <= a.cells; ++i) {
    if (a.face(i) != b.face(i)) return false;
  }
  return true;
}

std::string extent_text(const model::Axis& axis) {
  return fmt::format("{} cells from {} to {}", axis.cells, axis.low, axis.high);
}

}  // namespace

double OrderEstimate::error() const { return difference / (std::exp2(order) - 1); }

std::unique_ptr<DataSetMaker> DataSetMaker::open(const SourceFile& source, model::DataSet set,
                                                 const DataSetOptions& options, DiagnosticSink& sink) {
  std::unique_ptr<DataSetMaker> maker(new DataSetMaker(source, std::move(set), options));
  maker->session_ = maker->open_run(0, {}, sink);
  if (!maker->session_ || !maker->plan_frames(sink)) return nullptr;
  maker->plan_variables();
  const model::Problem& problem = maker->session_->problem();
  if (problem.steady > 0) {
    sink.report("not-allowed-here", problem.time_origin.range, {"until steady", "a scene of a data set"},
                "its runs have the same frames: leave it out");
    return nullptr;
  }
  maker->files_ = files::hash_of_files(maker->session_->problem(), source);
  for (const model::Axis& axis : maker->session_->axes()) {
    for (const model::DataSet::Grid& grid : maker->set_.grids) {
      if (axis.cells % grid.coarsen == 0) continue;
      sink.report("bad-optimiser-option", {},
                  {fmt::format("coarsen {}", grid.coarsen), "dataset " + maker->set_.name,
                   fmt::format("does not divide the {} cells along {}", axis.cells, axis.name)});
      return nullptr;
    }
  }
  return maker;
}

/// The scene of a run, with its parameters set as by --set.
DataSetMaker::Shared DataSetMaker::compile_run(int run, const std::map<std::string, std::string>& more,
                                               DiagnosticSink& sink) const {
  driver::CompileOptions compile_options;
  compile_options.selection = options_.selection;
  compile_options.selection.name = set_.scene;
  if (!set_.scheme.empty()) compile_options.selection.scheme = set_.scheme;
  for (std::size_t v = 0; v < set_.vary.size(); ++v)
    compile_options.selection.overrides[set_.vary[v].param] = fmt::format("{}", set_.value_of(v, run));
  compile_options.selection.shown = set_.of;
  if (set_.to) compile_options.selection.overrides["end"] = fmt::format("{}", *set_.to);
  for (const auto& [name, value] : more) compile_options.selection.overrides[name] = value;
  compile_options.backend = options_.backend;
  compile_options.cache = options_.cache;
  compile_options.runs = set_.runs;
  std::optional<driver::Compiled> compiled = driver::compile(source_, compile_options, sink);
  return compiled ? std::make_shared<const driver::Compiled>(std::move(*compiled)) : nullptr;
}

std::unique_ptr<driver::Session> DataSetMaker::session_of(std::shared_ptr<const driver::Compiled> compiled,
                                                          const std::atomic<bool>* stop, DiagnosticSink& sink) const {
  driver::SessionOptions session_options;
  session_options.stop = stop;
  return compiled ? driver::Session::open(source_, std::move(compiled), session_options, sink) : nullptr;
}

std::unique_ptr<driver::Session> DataSetMaker::open_run(int run, const std::map<std::string, std::string>& more,
                                                        DiagnosticSink& sink) const {
  return session_of(compile_run(run, more, sink), options_.stop, sink);
}

/// The scene on the grids of the frames; null where it cannot be compiled, e.g. because of files for its own grid.
std::vector<DataSetMaker::Shared> DataSetMaker::compile_stored(int run, const Shared& own) const {
  std::vector<Shared> all;
  for (const model::DataSet::Grid& grid : set_.grids) {
    std::map<std::string, std::string> more;
    for (const model::Axis& axis : session_->axes())
      more["cells." + axis.name] = fmt::format("{}", axis.cells / grid.coarsen);
    DiagnosticSink silent;
    all.push_back(grid.coarsen == 1 ? own : compile_run(run, more, silent));
  }
  return all;
}

/// Residuals remain unknown if the scene is unstable on the coarser grid; the frames are valid all the same.
void DataSetMaker::add_residuals(Shared stored, GridFrames& grid) const {
  const auto count = static_cast<std::size_t>(std::ranges::count(variables_, true, &FrameVariable::is_state));
  const std::vector<std::vector<double>> states(grid.frames.begin(),
                                                grid.frames.begin() + static_cast<std::ptrdiff_t>(count));
  grid.residuals.assign(count, {});
  if (times_.size() < 2) return;  // no interval between frames
  DiagnosticSink silent;
  std::atomic<bool> stop = false;
  try {
    const std::unique_ptr<driver::Session> session = session_of(std::move(stored), &stop, silent);
    if (!session || session->rollout().state_count() != static_cast<int>(count)) return;
    grid.residuals = analysis::residuals_of(*session, stop, {states, first_, every_, static_cast<int>(times_.size())},
                                            most_intervals);
  } catch (const Error&) {
    grid.residuals.assign(count, {});
  }
}

/// A name is a field or formula, or a vector with all its components.
void DataSetMaker::plan_variables() {
  const model::Problem& problem = session_->problem();
  const auto is_asked_for = [&](const std::string& name) {
    return std::ranges::any_of(set_.of, [&](const ast::NamedFormula& each) {
      return each.name.name == name || name.starts_with(each.name.name + ".");
    });
  };
  for (int s = 0; s < session_->rollout().state_count(); ++s) {
    const std::string& name = session_->rollout().state_name(s);
    const model::State* state = problem.find_state(name);
    variables_.push_back(
        {name, state != nullptr ? state->placement : model::Placement{}, true, set_.of.empty() || is_asked_for(name)});
  }
  for (const model::OutputField& shown : problem.shown) {
    if (is_asked_for(shown.name)) variables_.push_back({shown.name, shown.placement, false, true});
  }
}

/// Values of all variables at a state of a run.
std::vector<std::vector<double>> DataSetMaker::values_at(driver::Session& session, double t,
                                                         const std::vector<void*>& states) const {
  std::vector<std::vector<double>> all;
  std::map<std::string, std::vector<double>> shown;
  if (!set_.of.empty()) shown = session.shown(t, states);
  for (const FrameVariable& variable : variables_) {
    if (!variable.is_state) {
      all.push_back(std::move(shown.at(variable.name)));
      continue;
    }
    std::vector<double>& values = all.emplace_back(session.workspace().cell_count());
    copy_out(session.workspace().layout(), states[all.size() - 1], values);
  }
  return all;
}

bool DataSetMaker::plan_frames(DiagnosticSink& sink) {
  const model::Problem& problem = session_->problem();
  const auto steps_to = [&](double length, const char* what) -> std::optional<int> {
    const double steps = std::round(length / problem.step);
    if (std::abs(steps * problem.step - length) <= 1e-6 * problem.step && steps >= 0) return static_cast<int>(steps);
    sink.report("bad-optimiser-option", {},
                {what, "dataset " + set_.name, fmt::format("is no whole number of steps of {}", problem.step)});
    return std::nullopt;
  };
  const std::optional<int> every = set_.every > 0 ? steps_to(set_.every, "the interval of the frames") : 1;
  const std::optional<int> first = steps_to(set_.from.value_or(problem.t_begin) - problem.t_begin, "the first frame");
  if (!every || !first) return false;
  every_ = std::max(*every, 1);
  first_ = *first;
  for (int k = first_; k <= problem.steps; k += every_) times_.push_back(session_->time_of(k));
  if (!times_.empty()) return true;
  sink.report("bad-optimiser-option", {},
              {"frames", "dataset " + set_.name, fmt::format("are none up to t = {}", session_->end_time())});
  return false;
}

std::vector<int> DataSetMaker::cells(const model::DataSet::Grid& grid) const {
  std::vector<int> all;
  for (const model::Axis& axis : session_->axes()) all.push_back(axis.cells / grid.coarsen);
  return all;
}

std::uint64_t DataSetMaker::key() const {
  std::string text = print(session_->compiled().stencil) + std::string(source_.text());
  for (const auto& [name, value] : options_.selection.overrides) text += fmt::format("{}={}\n", name, value);
  text += fmt::format("{} {} {} {} {:016x}", set_.name, set_.seed, first_, every_, files_);
  for (const model::DataSet::Grid& grid : set_.grids) text += fmt::format(" {}", grid.coarsen);
  return hash_bytes(text.data(), text.size());
}

/// Varied parameters may change the compiled scene, but all runs of a file must have the same time axis and grid.
bool DataSetMaker::is_like_first(driver::Session& session, DiagnosticSink& sink) const {
  const auto differs = [&](const std::string& what) {
    sink.report("run-failed", set_.range, {what},
                "all runs of a data set have the same times and the same grid: what varies may not stand in them");
    return false;
  };
  const model::Problem &own = session.problem(), &first = session_->problem();
  if (own.step != first.step) return differs(fmt::format("its step is {}, that of run 0 is {}", own.step, first.step));
  if (own.t_begin != first.t_begin || own.steps != first.steps) {
    return differs(fmt::format("it is from t = {} to {}, run 0 from {} to {}", own.t_begin, session.end_time(),
                               first.t_begin, session_->end_time()));
  }
  for (std::size_t a = 0; a < first.axes.size(); ++a) {
    if (are_same_places(own.axes[a], first.axes[a])) continue;
    const std::string here = extent_text(own.axes[a]), there = extent_text(first.axes[a]);
    if (here == there)
      return differs(fmt::format("its {} is stretched otherwise than that of run 0", first.axes[a].name));
    return differs(fmt::format("its {} has {}, that of run 0 has {}", first.axes[a].name, here, there));
  }
  return true;
}

/// Computes `count` frames of a run, on all grids. Returns false after a diagnostic, and if stopped.
bool DataSetMaker::frames_of(driver::Session& session, int first, int every, int count, DataRun& to,
                             DiagnosticSink& sink) const {
  const std::vector<model::Axis>& axes = session.axes();
  Rollout& rollout = session.rollout();
  to.grids.assign(set_.grids.size(), {});
  for (GridFrames& grid : to.grids) grid.frames.assign(variables_.size(), {});
  to.integrals.assign(variables_.size(), {});
  const auto keep = [&](const Snapshot& snapshot) {
    if (snapshot.step < first || (snapshot.step - first) % every != 0 || (snapshot.step - first) / every >= count)
      return;
    const std::vector<std::vector<double>> all = values_at(session, snapshot.t, snapshot.states);
    for (std::size_t v = 0; v < variables_.size(); ++v) {
      const model::Placement& placement = variables_[v].placement;
      to.integrals[v].add(all[v], model::cell_volumes(axes, session.problem().metric, placement));
      for (std::size_t g = 0; g < set_.grids.size(); ++g) {
        const int ratio = set_.grids[g].coarsen;
        const std::vector<double> frame =
            ratio == 1 ? all[v] : driver::average_down(all[v], axes, with_cells(axes, ratio), placement);
        to.grids[g].frames[v].insert(to.grids[g].frames[v].end(), frame.begin(), frame.end());
      }
    }
  };
  const RunResult result = rollout.run({std::gcd(first, every), keep});
  if (result.blow_up) driver::report_blow_up(session, *result.blow_up, sink);
  if (result.blow_up || result.stopped) return false;
  // Runs are concatenated in a file: a shorter one would shift the rest.
  for (std::size_t g = 0; g < set_.grids.size(); ++g) {
    std::size_t wanted = static_cast<std::size_t>(count);
    for (const int cells : cells(set_.grids[g])) wanted *= static_cast<std::size_t>(cells);
    for (std::size_t v = 0; v < variables_.size(); ++v) {
      const std::size_t made = to.grids[g].frames[v].size();
      if (made == wanted) continue;
      sink.report("run-failed", set_.range,
                  {fmt::format("its frames of {} have {} values in all, not {}", variables_[v].name, made, wanted)});
      return false;
    }
  }
  return true;
}

/// Shared data of all threads that make runs.
struct DataSetMaker::Making {
  const Take* take;
  int first_failed;  // runs before it are completed, so that the reported run does not depend on the number of threads
  std::vector<Diagnostic> why = {};       // diagnostics of that run
  std::vector<Diagnostic> warnings = {};  // the first of each kind
  std::mutex mutex = {};                  // protects all of this, and compiling
};

bool DataSetMaker::make(const std::function<bool(int run)>& is_done, const Take& take, DiagnosticSink& sink) {
  std::vector<int> wanted;
  for (int run = 0; run < set_.runs; ++run) {
    if (!is_done(run)) wanted.push_back(run);
  }
  Making all{&take, set_.runs};
  Team(options_.threads).run(static_cast<std::int64_t>(wanted.size()), [&](std::int64_t i, int) {
    make_run(wanted[static_cast<std::size_t>(i)], all);
  });
  for (const Diagnostic& each : all.warnings) sink.add(each);
  for (Diagnostic each : all.why) {
    if (each.kind->severity != Severity::error) continue;
    each.message = fmt::format("run {} of dataset {}: {}", all.first_failed, set_.name, each.message);
    sink.add(std::move(each));
  }
  return all.first_failed == set_.runs && (options_.stop == nullptr || !options_.stop->load());
}

/// Makes one run. Errors belong to this run; it throws nothing.
void DataSetMaker::make_run(int run, Making& all) const {
  DiagnosticSink own;
  std::unique_ptr<driver::Session> session;
  std::vector<Shared> stored;
  bool goes_on = false, done = false;
  double spent = -driver::thread_cpu_seconds();
  try {
    {
      const std::lock_guard lock(all.mutex);  // one compilation at a time
      goes_on = run < all.first_failed && (options_.stop == nullptr || !options_.stop->load());
      const std::shared_ptr<const driver::Compiled> compiled = goes_on ? compile_run(run, {}, own) : nullptr;
      session = session_of(compiled, options_.stop, own);
      spent += driver::thread_cpu_seconds();
      if (session && options_.judge && !options_.judge(*session, own)) session.reset();
      if (session) stored = compile_stored(run, compiled);
      spent -= driver::thread_cpu_seconds();
    }
    DataRun data;
    for (std::size_t v = 0; v < set_.vary.size(); ++v) data.params.push_back(set_.value_of(v, run));
    if (session != nullptr && is_like_first(*session, own) &&
        frames_of(*session, first_, every_, static_cast<int>(times_.size()), data, own)) {
      data.cpu_seconds = spent + driver::thread_cpu_seconds();
      for (std::size_t g = 0; g < stored.size(); ++g) {
        add_residuals(std::move(stored[g]), data.grids[g]);
        for (std::size_t v = 0; v < variables_.size(); ++v) {
          if (!variables_[v].is_kept) data.grids[g].frames[v] = {};
        }
      }
      const std::lock_guard lock(all.mutex);
      (*all.take)(run, data);
      done = true;
    }
  } catch (const std::exception& error) {
    const auto* known = dynamic_cast<const Error*>(&error);
    driver::report_error(
        error, own, known && session ? driver::place_of_solve(session->compiled(), known->solve_for()) : SourceRange{});
  }
  const std::lock_guard lock(all.mutex);
  session.reset();  // stores its tuning in the cache
  for (const Diagnostic& each : own.all()) {
    const bool is_new = std::ranges::find(all.warnings, each.kind, &Diagnostic::kind) == all.warnings.end();
    if (each.kind->severity == Severity::warning && is_new) all.warnings.push_back(each);
  }
  if (goes_on && !done && run < all.first_failed) {
    all.first_failed = run;
    all.why = own.all();
  }
}

/// Why the order cannot be estimated; "" if runs with twice and four times the spacing and step have a state at step
/// `at`.
std::string DataSetMaker::why_no_order(int at) const {
  const model::Problem& problem = session_->problem();
  for (const model::Axis& axis : session_->axes()) {
    if (axis.cells % 4 == 0 && axis.cells / 4 >= fewest_cells) continue;
    return fmt::format("four times the spacing is no grid of {} or more cells along {}, which has {}", fewest_cells,
                       axis.name, axis.cells);
  }
  if (problem.has_parts()) return "its steps are as long as they can be, which is no fixed part of the spacing";
  if (at > problem.steps)
    return fmt::format(
        "twice and four times the step have no state between the first frame after the start and the "
        "end: it ends at step {}, they meet at step {}",
        problem.steps, at);
  return "";
}

/// Runs with 2^level times the spacing and step; returns values on the coarsest of the three grids. Returns why it
/// failed, or "".
std::string DataSetMaker::run_for_order(int at, int level, std::vector<std::vector<double>>& values) const {
  const model::Problem& problem = session_->problem();
  const std::string which =
      level == 0 ? "the run itself" : fmt::format("the run with {} times the spacing", 1 << level);
  std::map<std::string, std::string> more{{"step", fmt::format("{}", problem.step * (1 << level))},
                                          {"end", fmt::format("{}", problem.t_begin + at * problem.step)}};
  for (const model::Axis& axis : session_->axes()) more["cells." + axis.name] = fmt::format("{}", axis.cells >> level);
  DiagnosticSink sink;
  const std::unique_ptr<driver::Session> session = open_run(0, more, sink);
  if (!session) {
    for (const Diagnostic& each : sink.all()) {
      if (each.kind->severity == Severity::error) return fmt::format("{} cannot be made: {}", which, each.message);
    }
    return which + " cannot be made";
  }
  if (session->steps() != at >> level) return which + " has other steps";
  try {
    const RunResult result = session->rollout().run();
    if (result.stopped) return which + " was stopped";
    if (result.blow_up) return which + " blows up";
  } catch (const Error& error) {
    return fmt::format("{} fails: {}", which, error.what());
  }
  const double t = session->time_of(session->steps());
  values = values_at(*session, t, session->rollout().final_states());
  for (std::size_t v = 0; v < values.size(); ++v)
    values[v] =
        driver::average_down(values[v], session->axes(), with_cells(session_->axes(), 4), variables_[v].placement);
  return "";
}

namespace {

/// RMS of a - b after subtracting its mean.
double deviation(const std::vector<double>& a, const std::vector<double>& b) {
  const double mean = (std::accumulate(a.begin(), a.end(), 0.0) - std::accumulate(b.begin(), b.end(), 0.0)) /
                      static_cast<double>(a.size());
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i] - mean) * (a[i] - b[i] - mean);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

/// Estimates the order from three runs. If two fields with the same deviation s have the correlation c, the RMS of
/// their difference is s*sqrt(2 - 2c), which is s or more for c <= 1/2. Such runs are independent, as in a chaotic
/// flow, and their differences have no order. If most of the difference is in the means, an order is reported: the
/// variation may be small.
OrderEstimate order_of(const std::string& name, const std::vector<std::vector<double>>& runs, double t) {
  OrderEstimate estimate{name, root_of_mean_square(runs[0], runs[1])};
  const double far = root_of_mean_square(runs[1], runs[2]), apart = deviation(runs[1], runs[2]);
  const double own = deviation(runs[0], std::vector<double>(runs[0].size(), 0.0));
  estimate.order = std::log2(far / estimate.difference);
  if (estimate.difference == 0) {
    estimate.why_not = "the run with twice the spacing gives the same";
  } else if (own > 0 && apart >= own && 2 * apart * apart >= far * far) {
    estimate.why_not = fmt::format(
        "at t = {:.6g} the runs with twice and four times the spacing differ by {:.2g} of the field's own deviation: "
        "they go ways of their own, as in a chaotic flow or on grids that are too coarse",
        t, apart / own);
  } else if (!(far > estimate.difference)) {
    estimate.why_not = fmt::format(
        "the difference to twice the spacing, {:.2g}, is no less than that of twice to four "
        "times the spacing, {:.2g}",
        estimate.difference, far);
  }
  return estimate;
}

}  // namespace

std::vector<OrderEstimate> DataSetMaker::estimate_order() {
  const int at = (first_ + every_ + 3) / 4 * 4;  // a state common to all three runs
  std::string why = why_no_order(at);
  std::vector<std::vector<std::vector<double>>> runs(3);
  for (int level = 0; level < 3 && why.empty(); ++level)
    why = run_for_order(at, level, runs[static_cast<std::size_t>(level)]);
  std::vector<OrderEstimate> estimates;
  for (std::size_t v = 0; v < variables_.size(); ++v) {
    const std::string& name = variables_[v].name;
    if (!variables_[v].is_kept) continue;
    if (why.empty())
      estimates.push_back(order_of(name, {runs[0][v], runs[1][v], runs[2][v]}, session_->time_of(at)));
    else
      estimates.push_back({name, 0, 0, why});
  }
  return estimates;
}

}  // namespace dpde::training
