// SPDX-License-Identifier: Apache-2.0
#include "chart/point.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "driver/memory_plan.h"
#include "stability/verdict.h"

namespace dpde::chart {

std::string method_text(const Variant& variant) {
  std::vector<std::string> parts;
  for (const auto& [key, value] : variant.method) parts.push_back(key + "=" + value);
  return parts.empty() ? "the scene's own" : fmt::format("{}", fmt::join(parts, " "));
}

std::unique_ptr<driver::Session> open(const SourceFile& source, const PointOptions& options, const Variant& variant,
                                      std::string& why) {
  DiagnosticSink sink;
  driver::CompileOptions compile = options.compile;
  for (const auto* part : {&variant.method, &variant.resolution}) {
    for (const auto& [key, value] : *part) compile.selection.overrides[key] = value;
  }
  std::optional<driver::Compiled> compiled = driver::compile(source, compile, sink);
  std::unique_ptr<driver::Session> session;
  if (compiled && compiled->problem) {
    driver::SessionOptions open;
    open.threads = options.threads;
    open.stop = options.stop;
    session = driver::Session::open(source, std::make_shared<driver::Compiled>(std::move(*compiled)), open, sink);
  }
  for (const Diagnostic& diagnostic : sink.all()) {
    if (session == nullptr && why.empty() && diagnostic.kind->severity == Severity::error) why = diagnostic.message;
  }
  if (session == nullptr && why.empty()) why = "there is no scene";
  return session;
}

namespace {

/// Seconds of each sample, per run.
std::vector<double> time_runs(driver::Session& session, const PointOptions& options) {
  using Clock = std::chrono::steady_clock;
  std::vector<double> samples;
  while (std::ssize(samples) < options.samples) {
    int runs = 0;
    const auto start = Clock::now();
    double spent = 0;
    do {
      if (session.rollout().run().stopped) return samples;
      ++runs;
      spent = std::chrono::duration<double>(Clock::now() - start).count();
    } while (spent < options.sample_seconds);
    samples.push_back(spent / runs);
  }
  std::ranges::sort(samples);
  return samples;
}

void fail(Point& point, std::string why) { point.failure = std::move(why); }

/// False where the step is not run.
bool is_allowed(Point& point, driver::Session& session, const PointOptions& options) {
  const stability::Verdict verdict = stability::verdict_of(session);
  if (!verdict.is_analysed()) return true;
  if (verdict.limit.kind == stability::StepLimit::Kind::limit) point.largest_step = verdict.limit.step;
  if (!verdict.ruins_run() || options.may_be_unstable) return true;
  point.is_unstable = true;
  fail(point, verdict.limit.kind == stability::StepLimit::Kind::never
                  ? "unstable at every step"
                  : fmt::format("the step is above {:.4g}, the largest stable one", verdict.limit.step));
  return false;
}

}  // namespace

namespace {

Point run_or_throw(const SourceFile& source, const PointOptions& options, const Variant& variant,
                   const Reference& reference) {
  Point point;
  point.variant = variant;
  std::string why;
  const std::unique_ptr<driver::Session> session = open(source, options, variant, why);
  if (session == nullptr) {
    point.does_not_fit = true;
    fail(point, why);
    return point;
  }
  for (const model::Axis& axis : session->axes()) point.cells.push_back(axis.cells);
  point.step = session->problem().step;
  point.steps = session->steps();
  point.compile_seconds = session->compiled().seconds;
  point.memory_bytes = driver::peak_of_run(session->compiled());
  if (!is_allowed(point, *session, options)) return point;
  const RunResult first = session->rollout().run();
  if (first.stopped) return point;
  if (first.blow_up) {
    point.is_unstable = true;
    fail(point, fmt::format("no longer finite after step {}", first.blow_up->step));
    return point;
  }
  point.errors = reference.errors(*session);
  if (point.errors.empty()) {
    fail(point, "nothing to compare with");
    return point;
  }
  for (const auto& [name, error] : point.errors)
    point.error = error > point.error || std::isnan(error) ? error : point.error;
  const std::vector<double> samples = time_runs(*session, options);
  if (samples.empty()) return point;
  const double duration = session->steps() * session->problem().step;
  const auto quantile = [&](double part) {
    return samples[static_cast<std::size_t>(std::lround(part * static_cast<double>(samples.size() - 1)))] / duration;
  };
  point.seconds = quantile(0.5);
  point.low_quartile = quantile(0.25);
  point.high_quartile = quantile(0.75);
  return point;
}

}  // namespace

/// What one variant throws, for lack of memory as an example, leaves the others alone.
Point run_point(const SourceFile& source, const PointOptions& options, const Variant& variant,
                const Reference& reference) {
  try {
    return run_or_throw(source, options, variant, reference);
  } catch (const std::exception& error) {
    Point point;
    point.variant = variant;
    point.failure = error.what();
    return point;
  }
}

void mark_pareto(std::vector<Point>& points) {
  const auto is_complete = [](const Point& p) { return p.failure.empty() && p.seconds > 0 && std::isfinite(p.error); };
  for (Point& point : points) {
    point.is_pareto = is_complete(point) && std::ranges::none_of(points, [&](const Point& other) {
                        return is_complete(other) && other.error <= point.error && other.seconds <= point.seconds &&
                               (other.error < point.error || other.seconds < point.seconds);
                      });
  }
}

}  // namespace dpde::chart
