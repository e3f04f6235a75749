// SPDX-License-Identifier: Apache-2.0
#include "driver/memory_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <set>

#include "dpde/runtime/allocation.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/layout.h"
#include "driver/cost.h"
#include "driver/data.h"
#include "driver/declared.h"
#include "driver/whole_grid_cost.h"
#include "support/match.h"

namespace dpde::driver {

namespace {

/// How many passes leave something on each stack.
void note_passes(const std::vector<loop::Operation>& operations, std::vector<std::int64_t>& passes) {
  for (const loop::Operation& operation : operations) {
    match(
        operation, [](const loop::Fill&) {}, [](const loop::Fold&) {}, [](const loop::Reduce&) {},
        [](const loop::NetworkCall&) {}, [](const loop::Transform&) {}, [](const loop::Sweep&) {},
        [&](const loop::Solve& solve) { note_passes(solve.body, passes); },
        [&](const loop::Repeat& repeat) {
          for (const loop::Stacked& save : repeat.saves) passes[static_cast<std::size_t>(save.stack)] = repeat.count;
          note_passes(repeat.body, passes);
        });
  }
}

/// The fields of a Workspace by name, in the order of a session's work; the largest sum of all that is there is kept.
class Planner {
 public:
  explicit Planner(const Compiled& compiled)
      : compiled_(compiled), problem_(*compiled.problem), layout_(layout_of(compiled)) {
    field_ = static_cast<double>(bytes_of_field(layout_));
    array_ = static_cast<double>(8 * cell_count(layout_));
    for (const model::Axis& axis : problem_.axes) hold(axis.name);
    for (const std::uint64_t seed : problem_.noises()) hold(model::noise_name(seed));
  }

  double peak() const { return peak_; }
  double array() const { return array_; }
  double field() const { return field_; }
  void hold(const std::string& name, double count = 1) {
    fields_.insert(name);
    others_ += (count - 1) * field_;
    note();
  }
  /// Bytes that stay.
  void keep(double bytes) {
    others_ += bytes;
    note();
  }
  /// Bytes that are there for a moment.
  void note(double bytes = 0) {
    peak_ = std::max(peak_, static_cast<double>(fields_.size()) * field_ + others_ + bytes);
  }

  /// Workspace::execute, with states bound elsewhere.
  void execute(const std::string& name, bool states_given = false) {
    const loop::Program* program = find(name);
    if (program == nullptr) return;
    for (const std::string& field : program->fields) {
      if (!states_given || problem_.find_state(field) == nullptr) fields_.insert(field);
    }
    std::vector<std::int64_t> passes(program->stacks.size(), 0);
    note_passes(program->body, passes);
    double stacked = 0;
    for (std::size_t s = 0; s < passes.size(); ++s)
      stacked += static_cast<double>(bytes_of_stack(layout_, program->stacks[s], passes[s]));
    note(stacked);
  }
  /// Workspace::release.
  void release(const std::string& name) {
    const loop::Program* program = find(name);
    if (program == nullptr) return;
    for (std::size_t f = static_cast<std::size_t>(program->input_count); f < program->fields.size(); ++f)
      fields_.erase(program->fields[f]);
  }

  /// Files are read one by one; of states nothing stays beside the rollout's.
  void given() {
    for (const model::Coefficient& coefficient : problem_.coefficients) {
      const double count = coefficient.is_control() ? problem_.intervals(coefficient.every) : 1;
      hold(coefficient.name, count);
      if (!coefficient.value.formula) note(count * array_);
    }
  }
  /// Engine::update_formulas: states go where the rollout has them.
  void formulas() {
    for (const model::State& state : problem_.states) note(state.initial.file.empty() ? 0 : array_);
    for (const model::Coefficient& coefficient : problem_.coefficients) {
      if (coefficient.is_control() && coefficient.value.formula) execute(compiled_.names.controls.at(coefficient.name));
    }
    execute(compiled_.names.coefficients);
    execute(compiled_.names.initial, true);
    release(compiled_.names.initial);
  }
  /// Engine::jump_in_run, which keeps its rollout and fields. A byte a cell is a side; marks are read two at a time.
  void watch() {
    if (find(compiled_.names.watched) == nullptr) return;
    execute(compiled_.names.watched, true);
    keep(bytes_of_watched_run(compiled_));
    const auto is_marked = [](const Watched& watched) { return !watched.below.empty(); };
    const bool has_marks = std::ranges::any_of(compiled_.watched, is_marked);
    double sides = 0;
    for (const Watched& watched : compiled_.watched) sides += (watched.loss > 0 ? 2 : 1) * array_ / 8;
    note(sides + array_ + (has_marks ? 2 * array_ : 0));
  }
  /// What is said at the end of a run.
  void report() {
    execute(compiled_.names.observe, true);
    execute(compiled_.names.shown, true);
    release(compiled_.names.shown);
    execute(compiled_.names.constraints, true);
    if (find(compiled_.names.exact) != nullptr) {
      execute(compiled_.names.exact);
      note(2 * array_);
      release(compiled_.names.exact);
    }
    if (problem_.axes.size() == 1) note(array_);  // of which a curve is made
  }

 private:
  const loop::Program* find(const std::string& name) const {
    const auto found = std::ranges::find(compiled_.loop.programs, name, &loop::Program::name);
    return found == compiled_.loop.programs.end() ? nullptr : &*found;
  }

  const Compiled& compiled_;
  const model::Problem& problem_;
  const dpde_layout layout_;
  double field_ = 0, array_ = 0;
  std::set<std::string> fields_;
  double others_ = 0, peak_ = 0;
};

/// load_datum: the run of another scene, whose states become fields one by one, or the values of a file.
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
    // Each state is copied out on the grid of the run, and averaged on the own one.
    const double copied = 8 * static_cast<double>(cell_count(layout_of(*maker)));
    planner.note(peak_of_run(*maker) + copied + planner.array());
  } else if (!datum.file.empty()) {
    planner.note(count * planner.array());
  }
}

/// Places along the axes and the bounds of cells, as often as fields of some placement need them: numbers of a file.
double numbers_of_axes(const model::Problem& problem) {
  double numbers = 0;
  for (std::size_t a = 0; a < problem.axes.size(); ++a)
    numbers += 3.0 * problem.axes[a].cells * (problem.has_faces(a) ? 2 : 1);
  return numbers;
}

}  // namespace

double peak_of_run(const Compiled& compiled) {
  Planner planner(compiled);
  planner.given();
  planner.keep(bytes_of_rollout(compiled) + cost_of_transforms(compiled, compiled.step_name()).bytes);
  planner.formulas();
  planner.report();
  return planner.peak();
}

double bytes_of_outputs(const Compiled& compiled) {
  const model::Problem& problem = *compiled.problem;
  double states = 0;
  for (const model::Output& output : problem.outputs) {
    states += static_cast<double>(output.fields.size()) *
              (problem.steps / std::max(output.every, 1) + 1 + (output.every > 0 && problem.steps % output.every != 0));
  }
  const double of_end = static_cast<double>(problem.states.size());
  if (problem.outputs.empty()) states = 2 * of_end;
  const double cells = static_cast<double>(cell_count(layout_of(compiled)));
  const double stored = compiled.real() == Precision::f32 ? 4 : 8;
  // What was recorded is given back as it goes into the bytes of the file, of which there is a copy in the end.
  // Pictures take all of a plane, and nothing of a line or a volume that counts.
  const double pictures = problem.axes.size() == 2 ? 8 * of_end * cells : 0;
  return (8 + stored) * states * cells + 16 * numbers_of_axes(problem) + pictures;
}

double peak_of_gradient(const Compiled& compiled, const GradientPlan& plan, const SourceFile& source) {
  const model::Problem& problem = *compiled.problem;
  Planner planner(compiled);
  planner.given();
  for (const model::Datum& datum : problem.task->data) plan_datum(planner, compiled, datum, source);
  planner.keep(static_cast<double>(plan.field_bytes + plan.tape_bytes));
  planner.keep(cost_of_transforms(compiled, compiled.step_name()).bytes);
  const auto adjoint = compiled.derived.find(compiled.step_name());
  if (adjoint != compiled.derived.end() && adjoint->second.adjoint)
    planner.keep(cost_of_transforms(compiled, adjoint->second.adjoint->program).bytes);
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
  planner.keep(2 * unknowns);  // the scene's own values and the start
  planner.execute(compiled.names.start, true);
  planner.note(unknowns + computed);
  planner.keep(2 * unknowns);  // two gradients: the second one is timed
  planner.note(largest);
  planner.watch();
  for (const std::string& formula : compiled.formula_programs()) {
    const auto derived = compiled.derived.find(formula);
    if (derived != compiled.derived.end() && derived->second.adjoint) planner.execute(derived->second.adjoint->program);
  }
  return planner.peak();
}

namespace {

bool fits(const std::string& what, double needed, const std::function<SourceRange()>& place, DiagnosticSink& sink) {
  const auto there = static_cast<double>(available_memory());
  if (needed <= there) return true;
  const auto gibibytes = [](double bytes) { return fmt::format("{:.3g} GiB", bytes / (1 << 30)); };
  sink.report("machine-failed", place(),
              {fmt::format("{} needs {} of memory, {} are available", what, gibibytes(needed), gibibytes(there))},
              "fewer cells take less, and a gradient less where repeats make fewer passes");
  return false;
}

}  // namespace

bool run_fits(const Compiled& compiled, const SourceFile& source, DiagnosticSink& sink) {
  const std::string& scene = compiled.problem->scene;
  return fits(
      "scene " + scene, peak_of_run(compiled), [&] { return place_of(source, scene); }, sink);
}

bool gradient_fits(const Compiled& compiled, const StorageOptions& options, const SourceFile& source,
                   DiagnosticSink& sink) {
  const model::Problem& problem = *compiled.problem;
  const auto place = [&] { return place_of(source, problem.scene, problem.task->name); };
  try {
    const std::optional<GradientPlan> plan = plan_of_gradient(compiled, options);
    if (!plan) return true;
    const double needed = peak_of_gradient(compiled, *plan, source);
    return fits("a gradient of task " + problem.task->name, needed, place, sink);
  } catch (const Error& error) {
    sink.report("bad-option", place(), {error.what()}, "more for --memory, or fewer cells");
    return false;
  }
}

}  // namespace dpde::driver
