// SPDX-License-Identifier: Apache-2.0
#include "driver/scene/data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <span>

#include "driver/report/blow_up.h"
#include "driver/scene/window_start.h"
#include "files/array_file.h"
#include "files/trajectories.h"
#include "files/weights.h"
#include "model/analyse/placement.h"
#include "model/build.h"
#include "support/assert.h"

namespace dpde::driver {

namespace {

/// Step of a run nearest to `t`, or -1 if `t` is not a multiple of the step.
int step_at(const Session& session, double t) {
  const double position = (t - session.problem().t_begin) / session.problem().step;
  const double nearest = std::round(position);
  const bool fits = std::abs(position - nearest) < 1e-6 && nearest >= 0 && nearest <= session.steps();
  return fits ? static_cast<int>(nearest) : -1;
}

/// Why cells of `from` are not whole parts of cells of `to`; "" when they are.
std::string mismatch(const std::vector<model::Axis>& from, const std::vector<model::Axis>& to) {
  if (from.size() != to.size()) return fmt::format("it has {} axes, this scene {}", from.size(), to.size());
  for (std::size_t a = 0; a < to.size(); ++a) {
    if (from[a].name != to[a].name || std::abs(from[a].low - to[a].low) + std::abs(from[a].high - to[a].high) > 1e-12) {
      return fmt::format("its axis {} reaches from {} to {}, here axis {} reaches from {} to {}", from[a].name,
                         from[a].low, from[a].high, to[a].name, to[a].low, to[a].high);
    }
    if (from[a].runs_down() != to[a].runs_down()) return fmt::format("its axis {} runs the other way", from[a].name);
    if (from[a].cells % to[a].cells != 0) {
      return fmt::format("its {} cells along {} are no multiple of {}", from[a].cells, from[a].name, to[a].cells);
    }
    const int ratio = from[a].cells / to[a].cells;
    for (int i = 0; i < to[a].cells; ++i) {
      if (std::abs(from[a].face(std::int64_t{i} * ratio) - to[a].face(i)) <= 1e-9 * to[a].width(i)) continue;
      return fmt::format("its axis {} is stretched in another way: a face lies at {:.6g}, here at {:.6g}", from[a].name,
                         from[a].face(std::int64_t{i} * ratio), to[a].face(i));
    }
  }
  return "";
}

/// Times at which a datum is needed, in a run of `steps` steps.
std::vector<double> times_of(const model::Problem& problem, int steps, const model::When& when) {
  switch (when.kind) {
    case model::When::Kind::end: return {problem.t_begin + steps * problem.step};
    case model::When::Kind::at: return when.times;
    case model::When::Kind::over:
    case model::When::Kind::steps: break;
  }
  std::vector<double> times;
  for (int k = 0; k <= steps; ++k) times.push_back(problem.t_begin + k * problem.step);
  return times;
}

/// Settings of the scene that makes the data, so that the task's --set cells, step and end apply to it. Along an axis
/// where its grid would no longer fit, it keeps its ratio to the task's scene, or takes the same cells; a finer grid
/// needs proportionally more steps.
std::map<std::string, std::string> followed_settings(const Compiled& compiled, const model::Datum& datum) {
  const model::Selection& selection = compiled.options.selection;
  std::map<std::string, std::string> settings;
  if (selection.overrides.contains("end")) settings["end"] = selection.overrides.at("end");
  DiagnosticSink ignored;
  const auto as_written = [&](const std::string& name) {
    return model::from_ast(compiled.ast, {name, {}, ""}, ignored).value_or(model::Problem{});
  };
  const model::Problem other = as_written(datum.scene), own = as_written(compiled.problem->scene),
                       &now = *compiled.problem;
  if (other.axes.size() != now.axes.size() || own.axes.size() != now.axes.size()) return settings;
  bool follows = false;
  for (std::size_t a = 0; a < now.axes.size(); ++a) {
    const int cells = now.axes[a].cells, own_cells = own.axes[a].cells, other_cells = other.axes[a].cells;
    if (other_cells % cells == 0 || cells == own_cells) continue;
    const int ratio = other_cells % own_cells == 0 ? other_cells / own_cells : 1;
    settings["cells." + now.axes[a].name] = fmt::format("{}", std::int64_t{ratio} * cells);
    follows = true;
  }
  if (follows && now.step != own.step) settings["step"] = fmt::format("{}", other.step * (now.step / own.step));
  return settings;
}

double observed(Session& session, const std::string& name, const Snapshot& snapshot) {
  for (const auto& [observable, value] : session.observe(snapshot.t, snapshot.states)) {
    if (observable == name) return value;
  }
  unreachable("the model level knows the observables of a scene");
}

/// Receives the state at the k-th time, one at a time, so that only one copy exists.
using TakeState = std::function<void(std::size_t k, std::span<const double> values)>;

/// Runs the other scene and passes on a field, or an observable's value in all cells, at the given times. Returns false
/// on failure.
bool run_other_scene(Session& session, const model::Datum& datum, const std::vector<double>& times,
                     const TakeState& take, const SourceFile& source, DiagnosticSink& sink) {
  const SourceRange where = datum.origin.range;
  const auto fail = [&](const std::string& reason) {
    sink.report("data-of-other-scene", where, {datum.scene, reason});
    return false;
  };
  std::optional<Compiled> compiled = compile(source, options_of_maker(session.compiled(), datum), sink);
  if (!compiled) return false;
  SessionOptions session_options;
  session_options.threads = session.options().threads;
  session_options.stop = session.options().stop;
  session_options.judge = session.options().judge;
  const auto other = Session::open(source, std::make_shared<Compiled>(std::move(*compiled)), session_options, sink);
  if (!other || (session_options.judge && !session_options.judge(*other, sink))) return false;
  const std::string difference = mismatch(other->axes(), session.axes());
  if (!difference.empty() && !datum.series) return fail(difference);
  const int state = other->rollout().state_index(datum.field);
  if (state < 0 && !datum.series) return fail("it has no state " + datum.field);
  std::multimap<int, std::size_t> wanted;  // maps steps of the other run to indices of times
  int every = 0;
  for (std::size_t k = 0; k < times.size(); ++k) {
    const int step = step_at(*other, times[k]);
    if (step < 0) return fail(fmt::format("no step of it ends at t = {}", times[k]));
    wanted.emplace(step, k);
    every = std::gcd(every, step);
  }
  std::vector<double> values;
  const auto keep = [&](const Snapshot& snapshot) {
    const auto first = wanted.lower_bound(snapshot.step);  // a run until steady stays at its last state
    const auto last = snapshot.is_last ? wanted.end() : wanted.upper_bound(snapshot.step);
    if (first == last) return;
    if (datum.series) {
      values.assign(session.workspace().cell_count(), observed(*other, datum.field, snapshot));
    } else {
      values.resize(other->workspace().cell_count());
      copy_out(other->workspace().layout(), snapshot.states[static_cast<std::size_t>(state)], values);
      values = average_down(values, other->axes(), session.axes(), datum.placement);
    }
    for (auto one = first; one != last; ++one) take(one->second, values);
  };
  const RunResult result = other->rollout().run({every == 0 ? std::max(1, other->steps()) : every, keep});
  if (result.stopped) {
    sink.report("run-failed", datum.origin.range, {fmt::format("stopped while scene {} made the data", datum.scene)});
    return false;
  }
  if (result.blow_up) {
    DiagnosticSink of_run;
    report_blow_up(*other, *result.blow_up, of_run);
    for (Diagnostic each : of_run.all()) {
      each.message = fmt::format("scene {}, which makes the data: {}", datum.scene, each.message);
      sink.add(std::move(each));
    }
    return false;
  }
  report_not_steady(*other, result, sink);
  report_instabilities(*other, sink);
  return true;
}

/// Random values, different for each datum: the difference of two data must not vanish.
std::vector<double> made_up(const model::Task& task, const std::string& datum, std::size_t cells) {
  const auto number = std::ranges::find(task.data, datum, &model::Datum::name) - task.data.begin();
  std::mt19937_64 random(static_cast<std::uint64_t>(number) + 1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> state(cells);
  for (double& value : state) value = uniform(random);
  return state;
}

/// Times of the states in losses that contain the datum.
std::vector<double> compared_at(const model::Problem& problem, int steps, const model::Datum& datum) {
  std::vector<double> result;
  for (const model::Loss& loss : problem.task->losses) {
    if (!model::reads(loss.value, datum.name)) continue;
    if (loss.when.kind == model::When::Kind::end) result.push_back(problem.t_begin + steps * problem.step);
    if (loss.when.kind == model::When::Kind::at)
      result.insert(result.end(), loss.when.times.begin(), loss.when.times.end());
  }
  return result;
}

/// Reads the file of a datum, one state after the other: one number for each state, or values on the scene's grid. Used
/// for running a task and for checking its files.
std::optional<std::vector<double>> load_file(const model::Problem& problem, int steps, const model::Datum& datum,
                                             const SourceFile& source, DiagnosticSink& sink) {
  const bool last_state = datum.when.kind == model::When::Kind::end;
  files::ArrayFile from{datum.file, datum.variable,
                        last_state ? std::vector<double>{} : times_of(problem, steps, datum.when), datum.name};
  if (last_state) from.compared_at = compared_at(problem, steps, datum);
  from.unit = problem.unit_of(datum.name);
  const std::vector<model::Axis> axes =
      datum.series ? std::vector<model::Axis>{} : model::axes_at(problem.axes, datum.placement);
  return files::load_array(from, source, axes, problem.scheme.real, datum.origin.range, sink);
}

bool from_file(Session& session, const model::Datum& datum, std::size_t states, const TakeState& take,
               const SourceFile& source, DiagnosticSink& sink) {
  const std::optional<std::vector<double>> values = load_file(session.problem(), session.steps(), datum, source, sink);
  if (!values) return false;
  const std::size_t cells = session.workspace().cell_count();
  for (std::size_t k = 0; k < states; ++k) {
    if (datum.series) {
      take(k, std::vector<double>(cells, (*values)[k]));
    } else {
      take(k, std::span(*values).subspan(k * cells, cells));
    }
  }
  return true;
}

}  // namespace

CompileOptions options_of_maker(const Compiled& compiled, const model::Datum& datum) {
  CompileOptions options;
  options.selection.name = datum.scene;
  options.selection.overrides = followed_settings(compiled, datum);
  options.backend = Backend::jit;
  options.cache = compiled.options.cache;
  return options;
}

std::vector<double> made_up_values(std::size_t count) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(0.5, 1.5);
  std::vector<double> values(count);
  for (double& value : values) value = uniform(random);
  return values;
}

std::vector<double> times_of(const model::Problem& problem, const model::Coefficient& coefficient) {
  std::vector<double> times;
  for (int k = 0; coefficient.is_control() && k < problem.intervals(coefficient.every); ++k) {
    times.push_back(problem.t_begin + k * coefficient.every * problem.step);
  }
  return times;
}

namespace {

files::ArrayFile array_of(const model::Problem& problem, const model::Coefficient& coefficient,
                          const model::Source& from) {
  const std::vector<double> times = driver::times_of(problem, coefficient);
  return {from.file, from.variable, times, "", {}, problem.unit_of(coefficient.name)};
}

}  // namespace

std::optional<std::vector<double>> load_coefficient(Session& session, const model::Coefficient& coefficient,
                                                    const model::Source& from, const SourceFile& source,
                                                    DiagnosticSink& sink) {
  const model::Problem& problem = session.problem();
  if (session.options().made_up) {
    const std::size_t intervals =
        coefficient.is_control() ? static_cast<std::size_t>(problem.intervals(coefficient.every)) : 1;
    return made_up_values(intervals * session.workspace().cell_count());
  }
  const std::vector<model::Axis> axes = model::axes_at(problem.axes, coefficient.placement);
  const std::optional<std::vector<double>> loaded =
      coefficient.is_control()
          ? files::load_array(array_of(problem, coefficient, from), source, axes, problem.scheme.real,
                              from.origin.range, sink)
          : files::load_array(from, problem.unit_of(coefficient.name), source, axes, problem.scheme.real, sink);
  if (loaded && coefficient.is_mask) {
    const auto wrong = std::ranges::find_if(*loaded, [](double value) { return value != 0 && value != 1; });
    if (wrong != loaded->end()) {
      const std::string what = fmt::format("index {} holds {}, and a mask is 0 or 1", wrong - loaded->begin(), *wrong);
      sink.report("bad-array-file", from.origin.range, {from.file, what}, "round it where it is made");
      return std::nullopt;
    }
  }
  if (!loaded || session.options().cells.empty()) return loaded;
  const std::size_t states =
                        coefficient.is_control() ? static_cast<std::size_t>(problem.intervals(coefficient.every)) : 1,
                    size = loaded->size() / states;
  std::vector<double> values;
  for (std::size_t k = 0; k < states; ++k) {
    const auto begin = loaded->begin() + static_cast<std::ptrdiff_t>(k * size);
    const std::vector<double> one =
        resample({begin, begin + static_cast<std::ptrdiff_t>(size)}, problem.axes, session.axes());
    values.insert(values.end(), one.begin(), one.end());
  }
  return values;
}

namespace {

/// Checks the training and test data of a learning task.
void check_trajectories(const model::Problem& problem, const SourceFile& source, DiagnosticSink& sink) {
  std::set<std::string> seen;
  if (const model::Datum* windows = problem.task->datum_of_windows()) {
    const auto learnt = files::load_learnt_trajectories(problem, source, sink);
    const bool has_all = !learnt || learnt->names_of_data.empty();  // complete, so it need not be read again
    if (has_all) seen.insert(windows->file);
  }
  for (const std::vector<model::Test>* tests : {&problem.task->tests, &problem.task->growths}) {
    for (const model::Test& test : *tests) {
      if (!test.on.empty() && seen.insert(test.on).second)
        files::load_trajectories(problem, test.on, source, test.on_origin.range, sink);
    }
  }
}

}  // namespace

void check_files(const model::Problem& problem, const SourceFile& source, DiagnosticSink& sink) {
  const model::Placements placements(problem);
  const auto check = [&](const std::string& field, const model::Source& from) {
    if (from.file.empty()) return;
    const std::vector<model::Axis> axes = model::axes_at(problem.axes, placements.of(field));
    const model::Coefficient* coefficient = problem.find_coefficient(field);
    if (coefficient == nullptr || !coefficient->is_control()) {
      files::load_array(from, problem.unit_of(field), source, axes, problem.scheme.real, sink);
    } else {
      files::load_array(array_of(problem, *coefficient, from), source, axes, problem.scheme.real, from.origin.range,
                        sink);
    }
  };
  for (const model::Coefficient& coefficient : problem.coefficients) check(coefficient.name, coefficient.value);
  for (const model::State& state : problem.states) check(state.name, state.initial);
  files::load_weights(problem, source, sink);
  if (!problem.task) return;
  for (const model::Unknown& unknown : problem.task->unknowns) {
    if (unknown.kind == model::Unknown::Kind::network) continue;
    const model::State* state = problem.find_state(unknown.name);
    const bool is_the_scenes = state != nullptr && state->initial.origin.range == unknown.from.origin.range;
    if (!is_the_scenes) check(unknown.name, unknown.from);
  }
  check_trajectories(problem, source, sink);
  for (const model::Datum& datum : problem.task->data) {
    if (datum.file.empty() || datum.trajectories) continue;
    load_file(problem, problem.steps, datum, source, sink);
  }
}

std::vector<double> average_down(const std::vector<double>& fine, const std::vector<model::Axis>& from,
                                 const std::vector<model::Axis>& to, const model::Placement& placement) {
  std::array<int, 3> n{1, 1, 1}, ratio{1, 1, 1};
  std::array<std::vector<double>, 3> weights{{{1}, {1}, {1}}};  // of each fine cell in its coarse cell
  for (std::size_t a = 0; a < to.size(); ++a) {
    n[a] = to[a].cells;
    ratio[a] = from[a].cells / to[a].cells;
    weights[a].assign(static_cast<std::size_t>(from[a].cells), placement[a] ? 1.0 : 1.0 / ratio[a]);
    if (!to[a].stretch || placement[a]) continue;
    for (int i = 0; i < from[a].cells; ++i)
      weights[a][static_cast<std::size_t>(i)] = from[a].width(i) / to[a].width(i / ratio[a]);
  }
  const auto counts = [&](std::size_t axis, int place) { return !placement[axis] || (place + 1) % ratio[axis] == 0; };
  std::vector<double> result(static_cast<std::size_t>(n[0]) * n[1] * n[2], 0.0);
  std::size_t i = 0;
  for (int z = 0; z < n[2] * ratio[2]; ++z) {
    for (int y = 0; y < n[1] * ratio[1]; ++y) {
      for (int x = 0; x < n[0] * ratio[0]; ++x, ++i) {
        if (!counts(0, x) || !counts(1, y) || !counts(2, z)) continue;
        const std::size_t row = static_cast<std::size_t>(z / ratio[2]) * n[1] + y / ratio[1];
        const double weight = weights[0][static_cast<std::size_t>(x)] * weights[1][static_cast<std::size_t>(y)] *
                              weights[2][static_cast<std::size_t>(z)];
        result[row * n[0] + x / ratio[0]] += weight * fine[i];
      }
    }
  }
  return result;
}

std::vector<double> resample(const std::vector<double>& values, const std::vector<model::Axis>& from,
                             const std::vector<model::Axis>& to) {
  std::array<int, 3> n{1, 1, 1}, m{1, 1, 1};
  for (std::size_t a = 0; a < to.size(); ++a) {
    n[a] = to[a].cells;
    m[a] = from[a].cells;
  }
  std::vector<double> result;
  for (std::int64_t z = 0; z < n[2]; ++z) {
    for (std::int64_t y = 0; y < n[1]; ++y) {
      for (std::int64_t x = 0; x < n[0]; ++x) {
        const std::int64_t row = z * m[2] / n[2] * m[1] + y * m[1] / n[1];
        result.push_back(values[static_cast<std::size_t>(row * m[0] + x * m[0] / n[0])]);
      }
    }
  }
  return result;
}

namespace {

std::string field_of(const model::Datum& datum, std::size_t k) {
  return k == 0 ? datum.name : fmt::format("{}@{}", datum.name, k);
}

/// Data of the session's first training sample.
DataStates frames_of_window(Session& session, const model::Datum& datum) {
  const WindowStart& window = *session.options().window;
  const std::vector<double>& frames = window.data.at(datum.name);
  const std::size_t size = window.cells;
  const bool is_goal = frames.size() == size;  // or the only frame
  const auto count = is_goal ? 1 : static_cast<std::size_t>(session.steps() / window.every);
  DataStates result{datum.name, {}, {}};
  for (std::size_t k = 0; k < count; ++k) {
    const auto first = frames.begin() + static_cast<std::ptrdiff_t>(k * size);
    const std::vector<double> own(first, first + static_cast<std::ptrdiff_t>(size));
    if (!is_goal) result.times.push_back(session.time_of(static_cast<int>(k + 1) * window.every));
    result.fields.push_back(field_of(datum, k));
    session.workspace()
        .field(result.fields.back())
        .copy_in(session.options().cells.empty() ? own : resample(own, session.problem().axes, session.axes()));
  }
  return result;
}

}  // namespace

std::optional<DataStates> load_datum(Session& session, const model::Datum& datum, const SourceFile& source,
                                     DiagnosticSink& sink) {
  if (datum.begins_windows()) return DataStates{datum.name, {}, {}};
  // Each training sample has its own trajectory. A session without samples needs a run, whatever it is compared with.
  if (datum.trajectories && session.options().window != nullptr) return frames_of_window(session, datum);
  const bool is_made_up =
      !session.options().cells.empty() || datum.trajectories || (datum.file.empty() && datum.scene.empty());
  const std::vector<double> times =
      is_made_up ? std::vector<double>(1) : times_of(session.problem(), session.steps(), datum.when);
  DataStates result{datum.name, times.size() > 1 ? times : std::vector<double>{}, {}};
  for (std::size_t k = 0; k < times.size(); ++k) result.fields.push_back(field_of(datum, k));
  const TakeState take = [&](std::size_t k, std::span<const double> values) {
    session.workspace().field(result.fields[k]).copy_in(values);
  };
  if (is_made_up) {
    take(0, made_up(*session.problem().task, datum.name, session.workspace().cell_count()));
  } else if (!(datum.file.empty() ? run_other_scene(session, datum, times, take, source, sink)
                                  : from_file(session, datum, times.size(), take, source, sink))) {
    return std::nullopt;
  }
  return result;
}

}  // namespace dpde::driver
