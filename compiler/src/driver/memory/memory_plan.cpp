// SPDX-License-Identifier: Apache-2.0
#include "driver/memory/memory_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "codegen/program_table.h"
#include "dpde/runtime/allocation.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/executor.h"
#include "dpde/runtime/layout.h"
#include "dpde/runtime/netcdf.h"
#include "driver/compile/declared.h"
#include "driver/memory/cost.h"
#include "driver/scene/data.h"

namespace dpde::driver {

namespace {

/// Simulates which Workspace fields a session creates and drops, in order, and records the peak of the total memory.
class Planner {
 public:
  explicit Planner(const Compiled& compiled)
      : compiled_(compiled),
        problem_(*compiled.problem),
        layout_(layout_of(compiled)),
        tables_(compiled.loop, {}, nullptr) {
    field_ = static_cast<double>(bytes_of_field(layout_));
    array_ = static_cast<double>(8 * cell_count(layout_));
    for (const model::Axis& axis : problem_.axes) hold(axis.name);
    for (const std::uint64_t seed : problem_.noises()) hold(model::noise_name(seed));
  }

  const MemoryPlan& plan() const { return plan_; }
  double array() const { return array_; }
  double field() const { return field_; }
  void hold(const std::string& name, double count = 1) {
    fields_.insert(name);
    keep(of_fields, (count - 1) * field_);
  }
  /// Adds permanent bytes.
  void keep(const std::string& owner, double bytes) {
    kept_[owner] += bytes;
    note();
  }
  void keep(const std::vector<OwnedMemory>& owned) {
    for (const OwnedMemory& one : owned) {
      if (!one.shared.empty() && !shared_.insert(one.shared).second) continue;
      keep(one.owner, static_cast<double>(one.kept));
      making_ = std::max(making_, static_cast<double>(one.making));
    }
  }
  /// Adds the temporary memory of making solvers, which happens in the first run when all else is allocated.
  void make() { note(making_, "the making of a solver"); }
  /// Adds temporary bytes.
  void note(double bytes = 0, const std::string& owner = "arrays") {
    double sum = static_cast<double>(fields_.size()) * field_ + bytes;
    for (const auto& [name, kept] : kept_) sum += kept;
    if (sum <= plan_.peak) return;
    plan_.peak = sum;
    plan_.shares = kept_;
    plan_.shares[of_fields] += static_cast<double>(fields_.size()) * field_;
    plan_.shares[owner] += bytes;
  }

  /// Workspace::execute, with states bound elsewhere. The program's own working memory stays allocated.
  void execute(const std::string& name, bool states_given = false) {
    const dpde_program* program = tables_.find(name);
    if (program == nullptr) return;
    for (const char* field : std::span(program->fields, static_cast<std::size_t>(program->field_count))) {
      if (!states_given || problem_.find_state(field) == nullptr) fields_.insert(field);
    }
    if (executed_.insert(name).second) keep(Executor(*program, layout_).memory());
    note();
  }
  /// Workspace::release.
  void release(const std::string& name) {
    const dpde_program* program = tables_.find(name);
    if (program == nullptr) return;
    for (int f = program->input_count; f < program->field_count; ++f) fields_.erase(program->fields[f]);
  }

  /// Values read from files, one file at a time. States are copied to the rollout and not kept elsewhere.
  void given() {
    for (const model::Coefficient& coefficient : problem_.coefficients) {
      const double count = coefficient.is_control() ? problem_.intervals(coefficient.every) : 1;
      hold(coefficient.name, count);
      if (!coefficient.value.formula) note(count * array_);
    }
  }
  /// Engine::update_formulas: states are computed in the rollout's memory.
  void formulas() {
    for (const model::State& state : problem_.states) note(state.initial.file.empty() ? 0 : array_);
    for (const model::Coefficient& coefficient : problem_.coefficients) {
      if (coefficient.is_control() && coefficient.value.formula) execute(compiled_.names.controls.at(coefficient.name));
    }
    execute(compiled_.names.coefficients);
    execute(compiled_.names.initial, true);
    release(compiled_.names.initial);
  }
  /// Workspace::release_coordinates after formulas have run: drops coordinates that no program of a rollout reads.
  void release_coordinates() {
    const auto& names = compiled_.names;
    std::set<std::string> formulas = {names.coefficients, names.initial,     names.start, names.observe,
                                      names.shown,        names.constraints, names.exact};
    for (const auto& [control, formula] : names.controls) formulas.insert(formula);
    std::set<std::string_view> read;
    for (const std::string& name : tables_.names()) {
      if (formulas.contains(name)) continue;
      const dpde_program& program = *tables_.find(name);
      for (const char* field : std::span(program.fields, static_cast<std::size_t>(program.input_count)))
        read.insert(field);
    }
    for (const model::Axis& axis : problem_.axes) {
      if (!read.contains(axis.name)) fields_.erase(axis.name);
    }
  }
  /// Engine::jump_in_run, which keeps its rollout and fields. Sides take a byte for each cell; marks are read in pairs.
  void watch() {
    if (tables_.find(compiled_.names.watched) == nullptr) return;
    execute(compiled_.names.watched, true);
    const GradientPlan watched_run = plan_of_watched_run(compiled_);
    keep(of_fields, static_cast<double>(watched_run.field_bytes));
    keep(watched_run.owned);
    const auto is_marked = [](const Watched& watched) { return !watched.below.empty(); };
    const bool has_marks = std::ranges::any_of(compiled_.watched, is_marked);
    double sides = 0;
    for (const Watched& watched : compiled_.watched) sides += (watched.loss > 0 ? 2 : 1) * array_ / 8;
    note(sides + array_ + (has_marks ? 2 * array_ : 0));
  }
  /// Values computed for the report at the end of a run.
  void report() {
    execute(compiled_.names.observe, true);
    execute(compiled_.names.shown, true);
    release(compiled_.names.shown);
    execute(compiled_.names.constraints, true);
    if (tables_.find(compiled_.names.exact) != nullptr) {
      execute(compiled_.names.exact);
      note(2 * array_);
      release(compiled_.names.exact);
    }
    if (problem_.axes.size() == 1) note(array_);  // values of a curve
  }

 private:
  static constexpr const char* of_fields = "fields";

  const Compiled& compiled_;
  const model::Problem& problem_;
  const dpde_layout layout_;
  const codegen::ProgramTables tables_;
  double field_ = 0, array_ = 0;
  std::set<std::string> fields_, executed_, shared_;
  double making_ = 0;
  std::map<std::string, double> kept_;  // by owner, without the named fields
  MemoryPlan plan_;
};

/// load_datum: runs another scene, whose states become fields one by one, or reads a file.
void plan_datum(Planner& planner, const Compiled& compiled, const model::Datum& datum, const SourceFile& source) {
  double count = 1;
  if (!datum.trajectories && datum.when.kind == model::When::Kind::at)
    count = static_cast<double>(datum.when.times.size());
  if (!datum.trajectories && datum.when.kind != model::When::Kind::at && datum.when.kind != model::When::Kind::end)
    count = compiled.problem->steps + 1;
  planner.hold(datum.name, count);
  if (!datum.scene.empty()) {
    DiagnosticSink silent;
    CompileOptions options = options_of_maker(compiled, datum);
    options.backend.reset();
    const std::optional<Compiled> maker = compile(source, options, silent);
    if (!maker || !maker->problem) return;
    // Each state is copied on the run's grid, then averaged to this grid.
    const double copied = 8 * static_cast<double>(cell_count(layout_of(*maker)));
    planner.note(peak_of_run(*maker) + copied + planner.array());
  } else if (!datum.file.empty()) {
    planner.note(count * planner.array());
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
  Planner planner(compiled);
  planner.given();
  const GradientPlan rollout = plan_of_rollout(compiled);
  // Untouched pages take no memory: stages are allocated by the first step.
  const double states = static_cast<double>(compiled.problem->states.size()) * planner.field();
  planner.keep("states and stages", states);
  planner.formulas();
  planner.release_coordinates();
  planner.keep("states and stages", static_cast<double>(rollout.field_bytes) - states);
  planner.keep(rollout.owned);
  planner.make();
  planner.report();
  return planner.plan();
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
  // Pictures need all of a plane; of a line or a volume they need a negligible part.
  const double pictures = problem.axes.size() == 2 ? 8 * of_end * cells : 0;
  return std::max(8 * fields * cells, written) + 8 * numbers_of_axes(problem) + pictures;
}

MemoryPlan plan_of_gradient_memory(const Compiled& compiled, const GradientPlan& plan, const SourceFile& source) {
  const model::Problem& problem = *compiled.problem;
  Planner planner(compiled);
  planner.given();
  for (const model::Datum& datum : problem.task->data) plan_datum(planner, compiled, datum, source);
  planner.keep("states, stages and adjoints", static_cast<double>(plan.field_bytes));
  planner.keep("values stored for adjoints of networks and solves", static_cast<double>(plan.tape_bytes));
  planner.keep(plan.owned);
  planner.formulas();
  double unknowns = 0, largest = 0, computed = 0;
  for (const model::Unknown& unknown : problem.task->unknowns) {
    if (!unknown.is_field()) continue;
    const model::Coefficient* coefficient = problem.find_coefficient(unknown.name);
    const double count =
        coefficient != nullptr && coefficient->is_control() ? problem.intervals(coefficient->every) : 1;
    unknowns += count * planner.array();
    largest = std::max(largest, count * planner.array());
    if (unknown.from.formula && count == 1) computed += planner.field();
  }
  planner.keep("unknowns", 2 * unknowns);  // the scene's values and the start
  planner.execute(compiled.names.start, true);
  planner.note(unknowns + computed);
  planner.keep("unknowns", 2 * unknowns);  // two gradients: the second one is timed
  planner.note(largest);
  planner.make();
  planner.watch();
  for (const std::string& formula : compiled.formula_programs()) {
    const auto derived = compiled.derived.find(formula);
    if (derived != compiled.derived.end() && derived->second.adjoint) planner.execute(derived->second.adjoint->program);
  }
  return planner.plan();
}

double peak_of_gradient(const Compiled& compiled, const GradientPlan& plan, const SourceFile& source) {
  return plan_of_gradient_memory(compiled, plan, source).peak;
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
    const std::optional<GradientPlan> plan = plan_of_gradient(compiled, options);
    if (!plan) return true;
    const MemoryPlan needed = plan_of_gradient_memory(compiled, *plan, source);
    return fits("a gradient of task " + problem.task->name, needed, place, sink);
  } catch (const Error& error) {
    sink.report("bad-option", place(), {error.what()}, "more for --memory, or fewer cells");
    return false;
  }
}

}  // namespace dpde::driver
