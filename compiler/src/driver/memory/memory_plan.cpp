// SPDX-License-Identifier: Apache-2.0
#include "driver/memory/memory_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "dpde/runtime/allocation.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/layout.h"
#include "dpde/runtime/netcdf.h"
#include "driver/compile/declared.h"
#include "driver/memory/cost.h"
#include "driver/memory/dry_engine.h"
#include "driver/scene/data.h"
#include "model/analyse/flows.h"

namespace dpde::driver {

namespace {

constexpr const char* arrays = "arrays";  // the owner of values on their way to or from fields

/// Bytes of an array with a number for each cell.
double bytes_of_array(const Compiled& compiled) { return 8 * static_cast<double>(cell_count(layout_of(compiled))); }

/// Coefficients whose values are read from files, one file at a time.
void count_files(DryEngine& engine, const Compiled& compiled) {
  for (const model::Coefficient& coefficient : compiled.problem->coefficients) {
    if (coefficient.value.formula) continue;
    const double count = coefficient.is_control() ? compiled.problem->intervals(coefficient.every) : 1;
    engine.count().pass(arrays, count * bytes_of_array(compiled));
  }
  for (const model::State& state : compiled.problem->states) {
    if (!state.initial.file.empty()) engine.count().pass(arrays, bytes_of_array(compiled));
  }
}

/// The run before a gradient that looks for jumps (Engine::jump_in_run). The engine keeps its rollout and fields. Sides
/// take a byte for each cell; marks are read in pairs.
void count_watched_run(DryEngine& engine, const Compiled& compiled) {
  if (engine->scene().watched == nullptr) return;
  engine.execute(compiled.names.watched);
  if (engine->scene().watched_step != nullptr) {
    const GradientPlan watched = plan_gradient(engine->watched_setup());
    engine.count().hold(MemoryCount::of_fields, static_cast<double>(watched.field_bytes));
    engine.count().hold(watched.owned);
  }
  const auto is_marked = [](const Watched& watched) { return !watched.below.empty(); };
  const bool has_marks = std::ranges::any_of(compiled.watched, is_marked);
  const double array = bytes_of_array(compiled);
  double sides = 0;
  for (const Watched& watched : compiled.watched) sides += (watched.loss > 0 ? 2 : 1) * array / 8;
  engine.count().pass(arrays, sides + array + (has_marks ? 2 * array : 0));
}

/// Values computed for the report at the end of a run.
void count_report(DryEngine& engine, const Compiled& compiled) {
  engine.execute(compiled.names.observe);
  engine.execute(compiled.names.shown);
  engine.release(compiled.names.shown);
  engine.execute(compiled.names.constraints);
  if (engine.program(compiled.names.exact) != nullptr) {
    engine.execute(compiled.names.exact);
    engine.count().pass(arrays, 2 * bytes_of_array(compiled));
    engine.release(compiled.names.exact);
  }
  if (compiled.problem->axes.size() == 1) engine.count().pass(arrays, bytes_of_array(compiled));  // values of a curve
}

/// load_datum: runs another scene, whose states become fields one by one, or reads a file.
void count_datum(DryEngine& engine, const Compiled& compiled, const model::Datum& datum, const SourceFile& source) {
  if (datum.trajectories) return engine->take_datum(datum.name, {});  // made up, as for a session without samples
  std::size_t count = 1;
  if (datum.when.kind == model::When::Kind::at) count = datum.when.times.size();
  if (datum.when.kind != model::When::Kind::at && datum.when.kind != model::When::Kind::end)
    count = static_cast<std::size_t>(compiled.problem->steps) + 1;
  for (std::size_t k = 0; k < count; ++k) engine->workspace().field(datum.name, k);
  if (!datum.scene.empty()) {
    DiagnosticSink silent;
    CompileOptions options = options_of_maker(compiled, datum);
    options.backend.reset();
    const std::optional<Compiled> maker = compile(source, options, silent);
    if (!maker || !maker->problem) return;
    // Each state is copied on the run's grid, then averaged to this grid.
    const double copied = bytes_of_array(*maker);
    engine.count().pass("run of scene " + datum.scene, peak_of_run(*maker) + copied + bytes_of_array(compiled));
  } else if (!datum.file.empty()) {
    engine.count().pass(arrays, static_cast<double>(count) * bytes_of_array(compiled));
  }
}

/// Count of axis positions and cell bounds in a file, for all placements of fields.
double numbers_of_axes(const model::Problem& problem) {
  double numbers = 0;
  for (std::size_t a = 0; a < problem.axes.size(); ++a)
    numbers += 3.0 * problem.axes[a].cells * (problem.has_faces(a) ? 2 : 1);
  return numbers;
}

}  // namespace

MemoryPlan plan_of_run(const Compiled& compiled) {
  DryEngine engine(compiled);
  MemoryCount& count = engine.count();
  const GradientPlan rollout = plan_gradient(engine->setup());
  // Untouched pages take no memory: stages are allocated by the first step.
  const double states =
      static_cast<double>(compiled.problem->states.size()) * static_cast<double>(bytes_of_field(layout_of(compiled)));
  count.hold("states and stages", states);
  count_files(engine, compiled);
  engine->update_formulas();
  count.hold("states and stages", static_cast<double>(rollout.field_bytes) - states);
  count.hold(rollout.owned);
  count.pass_making();
  count_report(engine, compiled);
  return {count.peak(), count.shares()};
}

double peak_of_run(const Compiled& compiled) { return plan_of_run(compiled).peak; }

double bytes_of_outputs(const Compiled& compiled) {
  const model::Problem& problem = *compiled.problem;
  const double cells = static_cast<double>(cell_count(layout_of(compiled)));
  const double of_end = static_cast<double>(problem.states.size());
  double fields = problem.outputs.empty() ? of_end : 0;  // at one time
  for (const model::Output& output : problem.outputs)
    fields = std::max(fields, static_cast<double>(output.fields.size()));
  // Files are written one time at a time and read back field by field: as numbers, in the stored precision, and
  // compressed.
  const double stored = compiled.real() == Precision::f32 ? 4 : 8;
  const double part = std::max(cells, std::min(cells * (problem.steps + 1), NetcdfContent::values_at_once));
  const double written = (8 + (stored < 8 ? stored : 0)) * part + 3 * stored * NetcdfContent::values_at_once;
  // Pictures need all of a plane; of a line or a volume they need a negligible part. The vorticity of a flow is
  // computed from both components and two slopes.
  const std::size_t flows = model::flows_in_plane(problem).size();
  const double of_flows = flows > 0 ? static_cast<double>(flows) + 3 : 0;
  const double pictures = problem.axes.size() == 2 ? 8 * (of_end + of_flows) * cells : 0;
  return std::max(8 * fields * cells, written) + 8 * numbers_of_axes(problem) + pictures;
}

namespace {

/// Values of the unknown fields, and the gradients by them. Formulas of starts are computed field by field.
void count_unknowns(DryEngine& engine, const Compiled& compiled) {
  const model::Problem& problem = *compiled.problem;
  double unknowns = 0, largest = 0, computed = 0;
  for (const model::Unknown& unknown : problem.task->unknowns) {
    if (!unknown.is_field()) continue;
    const model::Coefficient* coefficient = problem.find_coefficient(unknown.name);
    const double count =
        coefficient != nullptr && coefficient->is_control() ? problem.intervals(coefficient->every) : 1;
    unknowns += count * bytes_of_array(compiled);
    largest = std::max(largest, count * bytes_of_array(compiled));
    if (unknown.from.formula && count == 1) computed += static_cast<double>(bytes_of_field(layout_of(compiled)));
  }
  engine.count().hold("unknowns", 2 * unknowns);  // the scene's values and the start
  engine.execute(compiled.names.start);
  engine.count().pass("unknowns", unknowns + computed);
  engine.count().hold("unknowns", 2 * unknowns);  // two gradients: the second one is timed
  engine.count().pass("unknowns", largest);
}

}  // namespace

std::optional<MemoryPlan> plan_of_gradient_memory(const Compiled& compiled, const StorageOptions& options,
                                                  const SourceFile& source) {
  DryEngine engine(compiled, options);
  if (!engine.has_gradient()) return std::nullopt;
  MemoryCount& count = engine.count();
  count_files(engine, compiled);
  for (const model::Datum& datum : compiled.problem->task->data) count_datum(engine, compiled, datum, source);
  const GradientPlan plan = plan_gradient(engine->objective_setup());
  count.hold("states, stages and adjoints", static_cast<double>(plan.field_bytes));
  count.hold("values stored for adjoints of networks and solves", static_cast<double>(plan.tape_bytes));
  count.hold(plan.owned);
  engine->update_formulas();
  count_unknowns(engine, compiled);
  count.pass_making();
  count_watched_run(engine, compiled);
  for (const dpde_program* adjoint : {engine->scene().coefficient_adjoint, engine->scene().initial_adjoint}) {
    if (adjoint != nullptr) engine->workspace().execute(*adjoint);
  }
  return MemoryPlan{count.peak(), count.shares()};
}

namespace {

std::string gibibytes(double bytes) { return fmt::format("{:.3g} GiB", bytes / (1 << 30)); }

/// "fields 1.2 GiB, solve for p 0.4 GiB": the three largest shares.
std::string text_of(const std::map<std::string, double>& shares) {
  std::vector<std::pair<std::string, double>> sorted(shares.begin(), shares.end());
  std::ranges::stable_sort(sorted, std::ranges::greater{}, &std::pair<std::string, double>::second);
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < std::min<std::size_t>(sorted.size(), 3); ++i)
    parts.push_back(fmt::format("{} {}", sorted[i].first, gibibytes(sorted[i].second)));
  return fmt::format("{}", fmt::join(parts, ", "));
}

bool fits(const std::string& what, const MemoryPlan& plan, const std::function<SourceRange()>& place,
          DiagnosticSink& sink) {
  const auto there = static_cast<double>(available_memory());
  if (plan.peak <= there) return true;
  sink.report("machine-failed", place(),
              {fmt::format("{} needs {} of memory, {} are available; most of it is of {}", what, gibibytes(plan.peak),
                           gibibytes(there), text_of(plan.shares))},
              "fewer cells take less, and a gradient less where repeats make fewer passes");
  return false;
}

}  // namespace

bool run_fits(const Compiled& compiled, const SourceFile& source, DiagnosticSink& sink) {
  const std::string& scene = compiled.problem->scene;
  return fits(
      "scene " + scene, plan_of_run(compiled), [&] { return place_of(source, scene); }, sink);
}

bool gradient_fits(const Compiled& compiled, const StorageOptions& options, const SourceFile& source,
                   DiagnosticSink& sink) {
  const model::Problem& problem = *compiled.problem;
  const auto place = [&] { return place_of(source, problem.scene, problem.task->name); };
  try {
    const std::optional<MemoryPlan> needed = plan_of_gradient_memory(compiled, options, source);
    return !needed || fits("a gradient of task " + problem.task->name, *needed, place, sink);
  } catch (const Error& error) {
    sink.report("bad-option", place(), {error.what()}, "more for --memory, or fewer cells");
    return false;
  }
}

}  // namespace dpde::driver
