// SPDX-License-Identifier: Apache-2.0
#include "chart/point.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>

#include "driver/memory/memory_plan.h"
#include "stability/stability_report.h"

namespace dpde::chart {

std::string method_text(const Variant& variant) {
  std::vector<std::string> parts;
  for (const auto& [key, value] : variant.method) parts.push_back(key + "=" + value);
  return parts.empty() ? "the scene's own" : fmt::format("{}", fmt::join(parts, " "));
}

void Measured::take(std::vector<double> timings) {
  std::ranges::sort(timings);
  samples = std::move(timings);
  // linear interpolation of quantiles: R. J. Hyndman and Y. Fan, Am. Statistician 50 (1996), definition 7
  const auto quantile = [&](double part) {
    const double place = part * static_cast<double>(samples.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, samples.size() - 1);
    return std::lerp(samples[below], samples[above], place - static_cast<double>(below));
  };
  seconds = quantile(0.5);
  low_quartile = quantile(0.25);
  high_quartile = quantile(0.75);
}

namespace {

constexpr std::int64_t most_checkpoint_bytes = std::int64_t{1} << 30;  // for gradients

/// Opens a session with `compile` and the variant's settings.
std::unique_ptr<driver::Session> open_with(const SourceFile& source, const PointOptions& options,
                                           driver::CompileOptions compile, const Variant& variant, std::string& why) {
  DiagnosticSink sink;
  for (const auto* part : {&variant.method, &variant.resolution}) {
    for (const auto& [key, value] : *part) {
      if (key == scheme_block) {
        compile.selection.scheme = value;
      } else {
        compile.selection.overrides[key] = value;
      }
    }
  }
  compile.runs = driver::any_number_of_runs;  // charts measure run times: optimise fully
  std::optional<driver::Compiled> compiled = driver::compile(source, compile, sink);
  std::unique_ptr<driver::Session> session;
  if (compiled && compiled->problem) {
    driver::SessionOptions open;
    open.threads = options.threads;
    open.stop = options.stop;
    open.checkpoint_bytes = most_checkpoint_bytes;
    open.judge = [](driver::Session& scene, DiagnosticSink& told) { return stability::check_step(scene, false, told); };
    session = driver::Session::open(source, std::make_shared<driver::Compiled>(std::move(*compiled)), open, sink);
  }
  for (const Diagnostic& diagnostic : sink.all()) {
    if (session == nullptr && why.empty() && diagnostic.kind->severity == Severity::error) why = diagnostic.message;
  }
  if (session == nullptr && why.empty()) why = "there is no scene";
  return session;
}

}  // namespace

std::unique_ptr<driver::Session> open(const SourceFile& source, const PointOptions& options, const Variant& variant,
                                      std::string& why) {
  return open_with(source, options, options.compile, variant, why);
}

std::unique_ptr<TaskGradient> open_gradient(const SourceFile& source, const PointOptions& options,
                                            const Variant& variant, std::string& why) {
  driver::CompileOptions compile = options.compile;
  compile.selection.name = options.task;
  compile.without_task = false;
  compile.adjoint = true;
  return TaskGradient::open(open_with(source, options, std::move(compile), variant, why), source, why);
}

namespace {

const std::string never_stable = "unstable at every step";

/// Seconds per run of each sample; `run` returns false if it was stopped.
std::vector<double> time_runs(const PointOptions& options, const std::function<bool()>& run) {
  using Clock = std::chrono::steady_clock;
  std::vector<double> samples;
  while (std::ssize(samples) < options.samples) {
    int runs = 0;
    const auto start = Clock::now();
    double spent = 0;
    do {
      if (!run()) return samples;
      ++runs;
      spent = std::chrono::duration<double>(Clock::now() - start).count();
    } while (spent < options.sample_seconds);
    samples.push_back(spent / runs);
  }
  return samples;
}

/// Returns false if the step must not be run.
bool is_allowed(Point& point, driver::Session& session) {
  const stability::StabilityReport verdict = stability::verdict_of(session);
  if (verdict.limit.kind == stability::StepLimit::Kind::limit) point.largest_step = verdict.limit.step;
  point.is_above_limit = verdict.is_above() && verdict.limit.kind == stability::StepLimit::Kind::limit;
  if (!verdict.ruins_run()) return true;
  if (verdict.limit.kind == stability::StepLimit::Kind::never) {
    point.fail(Outcome::never_stable, never_stable);
  } else {
    point.fail(Outcome::above_limit,
               fmt::format("the step is above {:.4g}, the largest stable one", verdict.limit.step));
  }
  return false;
}

/// Returns null if the variant is not applicable; `point` has the reason.
std::unique_ptr<driver::Session> open_for(Point& point, const SourceFile& source, const PointOptions& options,
                                          const Variant& variant) {
  std::string why;
  std::unique_ptr<driver::Session> session = open(source, options, variant, why);
  if (session == nullptr) point.fail(Outcome::does_not_fit, std::move(why));
  return session;
}

}  // namespace

bool choose_step(const SourceFile& source, const PointOptions& options, const model::Problem& scene, Entry& entry,
                 Point& point, double longest) {
  const std::unique_ptr<driver::Session> session = open_for(point, source, options, entry.variant);
  if (session == nullptr) return false;
  const stability::StabilityReport verdict = stability::verdict_of(*session);
  if (verdict.bounded_step() == 0) {
    point.fail(Outcome::never_stable, never_stable);
    return false;
  }
  // Without a limit: the scene's own step, scaled with the cell width. For exponential schemes the limit does not
  // shrink with the cells and does not indicate accuracy.
  double largest = scene.step * session->axes().front().spacing() / scene.axes.front().spacing();
  const bool is_told = std::isfinite(verdict.bounded_step()) && verdict.parts == 1;
  if (is_told && model::is_exponential(session->problem().scheme.time))
    largest = std::min(largest, verdict.bounded_step());
  else if (is_told)
    largest = point.largest_step = verdict.bounded_step();
  const double length = (options.common_steps > 0 ? options.common_steps : scene.steps) * scene.step;
  const double steps = std::max(1.0, std::ceil(length / std::min(largest * entry.fraction, longest) * (1 - 1e-12)));
  entry.variant.resolution["step"] = fmt::format("{}", length / steps);
  return true;
}

namespace {

/// A step chosen as fraction of the largest stable one needs no further stability check, unless no such step is known,
/// as for steps split by a Courant number.
void run_or_throw(const SourceFile& source, const PointOptions& options, const Entry& entry,
                  const References& references, Point& point) {
  const std::unique_ptr<driver::Session> session = open_for(point, source, options, entry.variant);
  if (session == nullptr) return;
  for (const model::Axis& axis : session->axes()) point.cells.push_back(axis.cells);
  point.step = session->problem().step;
  point.steps = session->steps();
  point.compile_seconds = session->compiled().seconds;
  point.memory_bytes = driver::peak_of_run(session->compiled());
  point.cost = driver::cost_of(session->compiled().loop, session->compiled().step_name());
  const bool is_judged = entry.fraction > 0 && entry.fraction <= 1 && point.largest_step > 0;
  if (!is_judged && !is_allowed(point, *session)) return;
  const RunResult first = session->rollout().run();
  if (first.stopped) return;
  if (first.blow_up) {
    point.fail(Outcome::blew_up, fmt::format("no longer finite after step {}", first.blow_up->step));
    return;
  }
  point.errors = references.states.errors(*session, options.measures);
  if (point.errors.empty() && !references.gradient.is_there()) {
    point.fail(Outcome::failed, "nothing to compare with");
    return;
  }
  for (const auto& [name, error] : point.errors)
    point.error = error > point.error || std::isnan(error) ? error : point.error;
  PointOptions timing = options;
  if (!options.times_states) {
    timing.samples = 1;
    timing.sample_seconds = 0;
  }
  std::vector<double> samples = time_runs(timing, [&] { return !session->rollout().run().stopped; });
  if (samples.empty()) return;
  const double duration = session->steps() * session->problem().step;
  for (double& sample : samples) sample /= duration;
  point.take(std::move(samples));
}

/// Requires a point that ran.
void add_gradient(const SourceFile& source, const PointOptions& options, const Variant& variant,
                  const GradientReference& reference, Point& point) {
  const std::unique_ptr<TaskGradient> task = open_gradient(source, options, variant, point.gradient_failure);
  if (task == nullptr || !task->run()) return;
  if (!task->is_finite()) {
    point.gradient_failure = "the loss or its gradient is not finite";
    return;
  }
  Measured measured;
  point.gradient_errors = reference.errors(task->parts(task->values()));
  if (point.gradient_errors.empty()) {
    point.gradient_failure = "no unknown of the task can be compared";
    return;
  }
  for (const auto& [name, error] : point.gradient_errors) measured.error = std::max(measured.error, error);
  std::vector<double> samples = time_runs(options, [&] { return task->run(); });
  if (samples.empty()) return;
  measured.take(std::move(samples));
  measured.memory_bytes = task->memory_bytes(source);
  point.gradient = std::move(measured);
}

}  // namespace

Point run_point(const SourceFile& source, const PointOptions& options, const model::Problem& scene, Entry entry,
                const References& references, const std::vector<Point>& known) {
  Point point;
  try {
    if (entry.fraction == 0 || choose_step(source, options, scene, entry, point)) {
      const auto same = std::ranges::find(known, entry.variant, &Point::variant);
      if (same != known.end()) return *same;
      run_or_throw(source, options, entry, references, point);
    }
  } catch (const std::exception& error) {
    point.fail(Outcome::failed, error.what());
  }
  try {
    if (is_complete(point) && references.gradient.is_there())
      add_gradient(source, options, entry.variant, references.gradient, point);
  } catch (const std::exception& error) {
    point.gradient_failure = error.what();
  }
  point.variant = std::move(entry.variant);
  return point;
}

bool is_complete(const Measured& measured) { return measured.seconds > 0 && std::isfinite(measured.error); }
bool is_complete(const Point& p) { return p.failure.empty() && is_complete(static_cast<const Measured&>(p)); }

bool beats(const Measured& a, const Measured& b) {
  constexpr double alike = 1.01;  // errors closer than this count as equal: shorter steps have no benefit
  return a.error <= alike * b.error && a.seconds <= b.seconds && (a.error < b.error || a.seconds < b.seconds);
}

void mark_pareto(std::vector<Point>& points) {
  for (Point& point : points) {
    point.is_pareto = is_complete(point) && std::ranges::none_of(points, [&](const Point& other) {
                        return is_complete(other) && beats(other, point);
                      });
    if (!point.gradient) continue;
    point.gradient->is_pareto =
        is_complete(*point.gradient) && std::ranges::none_of(points, [&](const Point& other) {
          return other.gradient && is_complete(*other.gradient) && beats(*other.gradient, *point.gradient);
        });
  }
}

}  // namespace dpde::chart
