// SPDX-License-Identifier: Apache-2.0
#include "chart/finer_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <functional>
#include <utility>

#include "chart/sweep.h"
#include "driver/scene/data.h"

namespace dpde::chart {

namespace {

constexpr double reference_fraction = 0.25;  // of the largest stable step
constexpr double no_agreement = 0.5;         // of two runs: neither can be a reference
constexpr int growth_of_work = 2;            // at least twice as many steps on twice as many cells: 2^(1 + axes)

bool reads_files(const model::Problem& problem) {
  const auto is_file = [](const model::Source& source) { return !source.file.empty(); };
  bool reads = !problem.weights.empty();
  for (const model::State& state : problem.states) reads = reads || is_file(state.initial);
  for (const model::Coefficient& coefficient : problem.coefficients) reads = reads || is_file(coefficient.value);
  if (!problem.task) return reads;
  for (const model::Datum& datum : problem.task->data) reads = reads || !datum.file.empty();
  for (const model::Unknown& unknown : problem.task->unknowns) reads = reads || is_file(unknown.from);
  return reads;
}

/// Whether the result can be cached: files, also those of scenes that make data, are not part of the key.
bool may_be_kept(const driver::Session& session) {
  const driver::Compiled& compiled = session.compiled();
  if (compiled.options.cache == nullptr || reads_files(session.problem())) return false;
  if (!session.problem().task) return true;
  return std::ranges::none_of(session.problem().task->data, [&](const model::Datum& datum) {
    if (datum.scene.empty()) return false;
    DiagnosticSink unread;
    const model::Selection selection = driver::options_of_maker(compiled, datum).selection;
    const std::optional<model::Problem> other = model::from_ast(compiled.ast, selection, unread);
    return !other || reads_files(*other);
  });
}

/// The text with its imports, and all selections.
std::string key_of(const SourceFile& source, const driver::Session& session) {
  const model::Selection& selection = session.compiled().options.selection;
  std::string key = fmt::format("reference of a chart\n{}\n{}\n{} cells {}\n", selection.name, selection.scheme,
                                session.compiled().options.without_task, session.workspace().cell_count());
  for (const auto& [name, value] : selection.overrides) key += fmt::format("{}={}\n", name, value);
  return key + std::string(source.text());
}

std::string bytes_of(const std::vector<double>& values) {
  std::string bytes(values.size() * sizeof(double), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

/// Returns the cached result of `run`, or runs it.
std::optional<std::vector<double>> kept_or_run(const SourceFile& source, const driver::Session& session,
                                               const std::function<std::optional<std::vector<double>>()>& run) {
  codegen::CodeCache* const cache = may_be_kept(session) ? session.compiled().options.cache.get() : nullptr;
  const std::string key = cache == nullptr ? "" : key_of(source, session);
  const std::optional<std::string> bytes = cache == nullptr ? std::nullopt : cache->find(key);
  if (bytes && bytes->size() % sizeof(double) == 0) {
    std::vector<double> values(bytes->size() / sizeof(double));
    std::memcpy(values.data(), bytes->data(), bytes->size());
    return values;
  }
  std::optional<std::vector<double>> values = run();
  if (values && cache != nullptr) cache->store(key, bytes_of(*values));
  return values;
}

/// A run that makes a reference, of states or of gradients.
template <class Result>
struct Finer {
  std::function<std::optional<Result>(const Variant&, std::string& why)> run;
  std::function<double(const Result& finest, const Result& second)> uncertainty;
  std::function<bool()> has_jumps = [] { return false; };  // of the initial states in the last two runs
};

template <class Result>
struct LastTwo {
  Result second, finest;
  std::string text;
  double uncertainty;
};

/// Uncertainty of the finest run, from the last two differences. With a jump two grids may agree by chance; its error
/// falls with first order at best.
double doubted(double difference, std::optional<double> before, bool has_jumps) {
  return has_jumps && before ? std::max(difference, 0.5 * *before) : difference;
}

std::string of_factor(const model::Problem& scene, double factor) {
  return fmt::format("on {:g} times the {}", factor, scene.has_grid ? "cells" : "steps");
}

/// Refines with one method.
template <class Result>
std::optional<LastTwo<Result>> refine(const SourceFile& source, const PointOptions& options,
                                      const model::Problem& scene, const Refinement& refinement,
                                      const std::map<std::string, std::string>& method, const Finer<Result>& finer,
                                      std::string& why) {
  using Clock = std::chrono::steady_clock;
  std::optional<Result> second;
  std::optional<double> before;
  for (double factor = refinement.first;; factor *= 2) {
    Entry entry = refined(scene, method, reference_fraction, factor);
    Point point;
    const auto start = Clock::now();
    // ordinary equations have no cells, and their largest stable step does not indicate accuracy
    const double longest = scene.has_grid ? std::numeric_limits<double>::infinity() : scene.step / factor;
    if (!choose_step(source, options, scene, entry, point, longest)) {
      why = point.failure;
      return std::nullopt;
    }
    std::optional<Result> result = finer.run(entry.variant, why);
    if (!result) return std::nullopt;
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    const double next_seconds = seconds * std::pow(2, scene.has_grid ? growth_of_work + std::ssize(scene.axes) - 1 : 1);
    if (!second) {
      second = std::move(result);
      continue;
    }
    const double difference = finer.uncertainty(*result, *second),
                 known = doubted(difference, before, finer.has_jumps());
    const bool is_enough = known <= refinement.enough && (before || !finer.has_jumps());
    if (is_enough || 2 * factor > refinement.most || next_seconds > refinement.most_seconds) {
      if (known < no_agreement)
        return LastTwo<Result>{std::move(*second), std::move(*result),
                               fmt::format("a run {} by {}", of_factor(scene, factor), method_text({method, {}})),
                               known};
      why = fmt::format("runs {} and half of that by {} differ by {:.2g} of it: they do not converge",
                        of_factor(scene, factor), method_text({method, {}}), known);
      return std::nullopt;
    }
    before = difference;
    second = std::move(result);
  }
}

template <class Result>
std::optional<LastTwo<Result>> last_two(const SourceFile& source, const PointOptions& options,
                                        const model::Problem& scene, const Refinement& refinement,
                                        const Finer<Result>& finer, std::string& why) {
  std::optional<LastTwo<Result>> found;
  if (scene.program.empty()) found = refine(source, options, scene, refinement, most_accurate(scene), finer, why);
  if (!found) {
    std::string again;
    std::map<std::string, std::string> own = exact_solves(scene.scheme);
    own["real"] = "f64";
    found = refine(source, options, scene, refinement, own, finer, again);
    if (!again.empty()) why = again;
  }
  if (!found && why.empty()) why = "finer runs blow up";
  return found;
}

/// Largest difference of adjacent points along any axis, relative to the range of the state.
double steepness(driver::Session& session) {
  double steepest = 0;
  for (int s = 0; s < session.rollout().state_count(); ++s) {
    const std::vector<double> values = session.initial(s);
    const auto [low, high] = std::ranges::minmax(values);
    std::size_t stride = 1;
    for (const model::Axis& axis : session.axes()) {
      const auto count = static_cast<std::size_t>(axis.cells);
      for (std::size_t i = 0; i + stride < values.size() && high > low; ++i) {
        if (i / stride % count + 1 < count)
          steepest = std::max(steepest, std::abs(values[i + stride] - values[i]) / (high - low));
      }
      stride *= count;
    }
  }
  return steepest;
}

std::optional<std::vector<double>> run_states(driver::Session& session) {
  const RunResult run = session.rollout().run();
  if (run.blow_up || run.stopped) return std::nullopt;
  std::vector<double> all;
  for (int s = 0; s < session.rollout().state_count(); ++s) {
    const std::vector<double> values = session.final_state(s);
    all.insert(all.end(), values.begin(), values.end());
  }
  return all;
}

}  // namespace

std::optional<Reference> make_reference(const SourceFile& source, const PointOptions& options,
                                        const model::Problem& scene, const Refinement& refinement, std::string& why) {
  Finer<FinalStates> finer;
  double steep = 0, steep_before = 0;  // halves for smooth states on half the cell width
  finer.has_jumps = [&] { return steep > 0.75 * steep_before; };
  finer.run = [&](const Variant& variant, std::string& reason) -> std::optional<FinalStates> {
    const std::unique_ptr<driver::Session> session = open(source, options, variant, reason);
    if (session == nullptr) return std::nullopt;
    steep_before = std::exchange(steep, steepness(*session));
    const auto values = kept_or_run(source, *session, [&] { return run_states(*session); });
    return values ? std::optional(final_states(*session, *values)) : std::nullopt;
  };
  finer.uncertainty = [&](const FinalStates& finest, const FinalStates& second) {
    return Reference(finest, second, options.measures, "").uncertainty();
  };
  std::optional<LastTwo<FinalStates>> runs = last_two(source, options, scene, refinement, finer, why);
  if (!runs) return std::nullopt;
  Reference reference(std::move(runs->finest), std::move(runs->second), options.measures, std::move(runs->text));
  reference.doubt(runs->uncertainty);
  return reference;
}

std::optional<GradientReference> make_gradient_reference(const SourceFile& source, const PointOptions& options,
                                                         const model::Problem& scene, const Refinement& refinement,
                                                         std::string& why) {
  Finer<GradientParts> finer;
  finer.run = [&](const Variant& variant, std::string& reason) -> std::optional<GradientParts> {
    const std::unique_ptr<TaskGradient> task = open_gradient(source, options, variant, reason);
    if (task == nullptr) return std::nullopt;
    const auto values = kept_or_run(source, task->session(), [&]() -> std::optional<std::vector<double>> {
      if (!task->run()) return std::nullopt;
      if (!task->is_finite()) reason = "the loss or its gradient is not finite";
      return task->is_finite() ? std::optional(task->values()) : std::nullopt;
    });
    return values ? std::optional(task->parts(*values)) : std::nullopt;
  };
  finer.uncertainty = [](const GradientParts& finest, const GradientParts& second) {
    return GradientReference(finest, second, "").uncertainty();
  };
  std::optional<LastTwo<GradientParts>> runs = last_two(source, options, scene, refinement, finer, why);
  if (!runs) return std::nullopt;
  return GradientReference(std::move(runs->finest), runs->second, "the gradient of " + runs->text);
}

}  // namespace dpde::chart
