// SPDX-License-Identifier: Apache-2.0
#include "files/trajectories.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "dpde/runtime/bytes.h"
#include "dpde/runtime/error.h"
#include "files/array_file.h"
#include "files/data_set_cost.h"
#include "files/files.h"
#include "model/analyse/placement.h"
#include "support/maths/evaluate.h"

namespace dpde::files {

namespace {

using Shape = std::vector<std::int64_t>;

std::string text_of_shape(const Shape& shape) { return fmt::format("({})", fmt::join(shape, ", ")); }

std::string count_of(std::int64_t count, std::string_view what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

/// Steps between frames; 0 if that is not an integer.
int steps_between(const std::vector<double>& times, double step) {
  const double spacing = (times.back() - times.front()) / static_cast<double>(times.size() - 1);
  const double steps = std::round(spacing / step);
  return steps >= 1 && std::abs(spacing - steps * step) <= 1e-6 * step ? static_cast<int>(steps) : 0;
}

/// Parts of a file to read.
struct Wanted {
  std::vector<const model::Datum*> data = {};  // those with values
  const Trajectories* windows = nullptr;       // with the first frames; null: this file has them
};

/// Reads one file; every fault is thrown as Error, which the caller reports.
class Reader {
 public:
  Reader(const model::Problem& problem, const Wanted& wanted, const NetcdfReader& file, Trajectories& to)
      : problem_(problem), wanted_(wanted), file_(file), to_(to) {}

  /// Warns if a parameter common to all runs differs from the scene's. The scene's value is used; the difference may be
  /// intended.
  void compare_params(SourceRange where, DiagnosticSink& sink) const {
    constexpr double rounding = 1e-12;
    for (const model::Parameter& param : problem_.params) {
      const NetcdfReader::Variable* variable = find(param.name);
      if (param.unknown || problem_.find_control(param.name) != nullptr || variable == nullptr ||
          !variable->shape.empty() || is_told_elsewhere(param.name))
        continue;
      const double value = file_.read(*variable).at(0);
      if (std::abs(value - param.value) <= rounding * std::max(std::abs(value), std::abs(param.value))) continue;
      sink.report(
          "data-of-other-parameter", where,
          {to_.path, param.name, fmt::format("{}", value), problem_.scene, fmt::format("{}", param.value)},
          fmt::format("windows are run with the scene's; --set {}={} takes that of the data", param.name, value));
    }
  }

  void read() {
    std::set<std::string> wanted;
    for (const model::Datum* datum : wanted_.data) wanted.insert(datum->variable);
    if (wanted_.windows == nullptr) {
      find_states(wanted);
    } else {
      to_.runs.resize(wanted_.windows->runs.size());
      to_.cells = wanted_.windows->cells;
    }
    std::erase_if(wanted, [&](const std::string& name) {
      if (!lacks_time(name)) return false;
      to_.goals.push_back(name);
      return true;
    });
    for (const std::string& name : wanted) read_field(name);
    for (const std::string& name : to_.goals) read_field(name);
    to_.has_frames_of_data =
        std::ranges::any_of(wanted_.data, [&](const model::Datum* datum) { return !to_.is_goal(datum->variable); });
    if (!time_.empty()) read_times();
    to_.looks = to_.has_frames_of_data ? to_.every : 1;
    read_params();
  }

 private:
  void find_states(std::set<std::string>& wanted) {
    for (const model::State& state : problem_.states) {
      if (find(state.name) == nullptr) continue;
      wanted.insert(state.name);
      to_.states.push_back(state.name);
    }
    if (to_.states.empty())
      fail(fmt::format("it has none of the states of scene {} ({})", problem_.scene,
                       fmt::join(names(problem_.states), ", ")));
  }

  [[noreturn]] void fail(const std::string& what) const { throw Error(ErrorKind::input, what); }

  template <class T>
  static std::vector<std::string> names(const std::vector<T>& items) {
    std::vector<std::string> all;
    for (const T& item : items) all.push_back(item.name);
    return all;
  }

  const NetcdfReader::Variable* find(const std::string& name) const { return file_.find(name); }

  /// The scene's state of this name, if this file has the first frames.
  const model::State* find_state(const std::string& variable) const {
    return wanted_.windows == nullptr ? problem_.find_state(variable) : nullptr;
  }
  model::Placement placement_of(const std::string& variable) const {
    if (const model::State* state = find_state(variable)) return state->placement;
    const auto datum = std::ranges::find(wanted_.data, variable, &model::Datum::variable);
    return datum == wanted_.data.end() ? model::Placement{} : (*datum)->placement;
  }
  /// Whether the file with the first frames has the parameter; the two files are compared later.
  bool is_told_elsewhere(const std::string& param) const {
    return wanted_.windows != nullptr &&
           (wanted_.windows->numbers.contains(param) ||
            std::ranges::find(wanted_.windows->params, param) != wanted_.windows->params.end());
  }

  /// Whether the variable has no time axis: one array for each run, or one for all runs.
  bool lacks_time(const std::string& name) const {
    const NetcdfReader::Variable* variable = find(name);
    if (variable == nullptr || find_state(name) != nullptr) return false;
    const std::size_t rank = model::axes_at(problem_.axes, placement_of(name)).size(), has = variable->shape.size();
    return has == rank || (has == rank + 1 && variable->dimensions[0] == "run");
  }

  void read_field(const std::string& name) {
    const NetcdfReader::Variable* variable = find(name);
    if (variable == nullptr) {
      const std::vector<std::string> there = names(file_.variables());
      const std::string near = nearest_name(name, there);
      fail(fmt::format("it has no variable {}{}; it has {}", name,
                       near.empty() ? "" : fmt::format(" (did you mean {}?)", near), fmt::join(there, ", ")));
    }
    const model::Placement placement = placement_of(name);
    const std::vector<model::Axis> axes = model::axes_at(problem_.axes, placement);
    const std::size_t rank = axes.size();
    const std::size_t own = rank + (to_.is_goal(name) ? 0 : 1);
    const bool has_runs = variable->shape.size() == own + 1;
    if (!has_runs && variable->shape.size() != own) {
      fail(fmt::format("{} has the shape {}, wanted is time and {} axes, or run, time and {}", name,
                       text_of_shape(variable->shape), rank, rank));
    }
    if (has_runs && variable->dimensions[0] != "run")
      fail(fmt::format("the first dimension of {} is {}, not run", name, variable->dimensions[0]));
    for (std::size_t a = 0; a < rank; ++a) {
      const std::size_t d = variable->shape.size() - 1 - a;
      const std::string& dimension = variable->dimensions[d];
      if (variable->shape[d] != axes[a].cells) {
        fail(fmt::format("it is of another grid: {} has {} cells along {}, the scene has {}", name, variable->shape[d],
                         dimension, axes[a].cells));
      }
      const std::string why = axis_mismatch(file_, axes[a], dimension);
      if (why.empty()) continue;
      model::Placement other = placement;
      other[a] = !other[a];
      if (axis_mismatch(file_, model::axes_at(problem_.axes, other)[a], dimension).empty()) {
        fail(fmt::format("{} lies {} along {} there and {} here: its line says where, as in data r on faces.{} = ...",
                         name, other[a] ? "on faces" : "at centres", axes[a].name,
                         placement[a] ? "on faces" : "at centres", "xyz"[a]));
      }
      fail(why);
    }
    if (to_.is_goal(name)) return take_goal(*variable, has_runs);
    take(*variable, has_runs);
    const std::optional<double> error = file_.number(name, attribute_of_error);
    const std::optional<std::string> why_not = file_.text(name, attribute_of_no_error);
    if (error || why_not) to_.own_errors[name] = {error.value_or(0), why_not.value_or("")};
  }

  void take_goal(const NetcdfReader::Variable& variable, bool has_runs) {
    if (has_runs && variable.shape[0] != std::ssize(to_.runs))
      fail(fmt::format("{} has {}, {} {}", variable.name, count_of(variable.shape[0], "run"),
                       wanted_.windows == nullptr ? "its fields have" : wanted_.windows->path + " has",
                       to_.runs.size()));
    const std::vector<double> all = file_.read(variable);
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!std::isfinite(rounded(all[i], problem_.scheme.real)))
        fail(fmt::format("{} is {} in run {}, cell {}", variable.name, shown(all[i]), i / to_.cells, i % to_.cells));
    }
    for (std::size_t r = 0; r < to_.runs.size(); ++r) {
      const auto begin = all.begin() + static_cast<std::ptrdiff_t>(has_runs ? r * to_.cells : 0);
      to_.runs[r].frames[variable.name] =
          std::make_shared<const std::vector<double>>(begin, begin + static_cast<std::ptrdiff_t>(to_.cells));
    }
  }

  void take(const NetcdfReader::Variable& variable, bool has_runs) {
    const auto runs = static_cast<std::size_t>(has_runs ? variable.shape[0] : 1);
    const std::int64_t frames = variable.shape[has_runs ? 1 : 0];
    const std::string& time = variable.dimensions[has_runs ? 1 : 0];
    if (time_.empty()) {
      time_ = time;
      frames_ = frames;
      to_.runs.resize(runs);
    }
    if (time != time_ || frames != frames_ || runs != to_.runs.size())
      fail(fmt::format("{} has other runs or times than the variables before it", variable.name));
    const std::vector<double> all = file_.read(variable);
    const std::size_t size = runs == 0 ? 0 : all.size() / runs;
    to_.cells = frames == 0 ? 0 : size / static_cast<std::size_t>(frames);
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (std::isfinite(rounded(all[i], problem_.scheme.real))) continue;
      fail(fmt::format("{} is {} in run {}, frame {}, cell {}", variable.name, shown(all[i]), i / size,
                       i % size / to_.cells, i % to_.cells));
    }
    for (std::size_t r = 0; r < runs; ++r) {
      const auto begin = all.begin() + static_cast<std::ptrdiff_t>(r * size);
      to_.runs[r].frames[variable.name] =
          std::make_shared<const std::vector<double>>(begin, begin + static_cast<std::ptrdiff_t>(size));
    }
  }

  void read_times() {
    const NetcdfReader::Variable* coordinate = find(time_);
    if (coordinate == nullptr || coordinate->shape != Shape{frames_})
      fail(fmt::format("it does not say at which times its {} frames are", frames_));
    to_.times = file_.read(*coordinate);
    if (to_.times.size() == 1 && !to_.has_frames_of_data) return;  // the initial state of each run
    if (to_.times.size() < 2) fail(fmt::format("it has {} frames; a window needs at least two", to_.times.size()));
    if (to_.runs.empty()) fail("it has no run");
    const double spacing = (to_.times.back() - to_.times.front()) / static_cast<double>(to_.times.size() - 1);
    to_.every = steps_between(to_.times, problem_.step);
    if (to_.every == 0)
      fail(fmt::format("its frames are {:.6g} apart, no whole number of steps of {:.6g}", spacing, problem_.step));
    for (std::size_t k = 0; k < to_.times.size(); ++k) {
      const double expected = to_.times.front() + static_cast<double>(k) * spacing;
      if (std::abs(to_.times[k] - expected) <= 1e-6 * spacing) continue;
      fail(fmt::format("its frames are not at equal intervals: frame {} is at t = {:.6g}, not at {:.6g}", k,
                       to_.times[k], expected));
    }
  }

  /// Reads parameters, except unknown ones.
  void read_params() {
    for (const model::Parameter& param : problem_.params) {
      const NetcdfReader::Variable* variable = find(param.name);
      if (param.unknown || variable == nullptr) continue;
      if (variable->shape.empty()) to_.numbers[param.name] = file_.read(*variable).at(0);
      if (variable->dimensions != std::vector<std::string>{"run"}) continue;
      const std::vector<double> values = file_.read(*variable);
      if (values.size() != to_.runs.size())
        fail(fmt::format("{} has {} values for {} runs", param.name, values.size(), to_.runs.size()));
      to_.params.push_back(param.name);
      if (file_.text(param.name, attribute_of_counts)) to_.counted.insert(param.name);
      for (std::size_t r = 0; r < values.size(); ++r) {
        if (!std::isfinite(values[r])) fail(fmt::format("{} is {} in run {}", param.name, shown(values[r]), r));
        to_.runs[r].params.push_back(values[r]);
      }
    }
  }

  const model::Problem& problem_;
  const Wanted& wanted_;
  const NetcdfReader& file_;
  Trajectories& to_;
  std::string time_;
  std::int64_t frames_ = 0;
};

}  // namespace

std::span<const double> Trajectories::frames(int run, const std::string& variable, int first, int count) const {
  const std::vector<double>& all = *runs[static_cast<std::size_t>(run)].frames.at(variable);
  if (is_goal(variable)) return all;
  return std::span(all).subspan(static_cast<std::size_t>(first) * cells, static_cast<std::size_t>(count) * cells);
}

std::uint64_t Trajectories::hash() const { return hash_bytes(hashes.data(), hashes.size() * sizeof(hashes[0])); }

double Trajectories::deviation(const std::string& variable) const {
  double sum = 0, squares = 0, count = 0;
  for (const Run& run : runs) {
    for (const double value : *run.frames.at(variable)) {
      sum += value;
      ++count;
    }
  }
  const double mean = sum / count;
  for (const Run& run : runs) {
    for (const double value : *run.frames.at(variable)) squares += (value - mean) * (value - mean);
  }
  return std::sqrt(squares / count);
}

std::optional<Trajectories> Trajectories::in_steps_of(double step) const {
  Trajectories same = *this;
  same.every = times.size() < 2 ? 1 : steps_between(times, step);
  if (same.every == 0) return std::nullopt;
  same.looks = has_frames_of_data ? same.every : 1;
  return same;
}

namespace {

std::optional<Trajectories> load(const model::Problem& problem, const Wanted& wanted, const std::string& file,
                                 const SourceFile& source, SourceRange where, DiagnosticSink& sink) {
  Trajectories trajectories;
  trajectories.path = find_data_file(file, source.path()).string();
  std::optional<std::string> bytes = read_file(trajectories.path, where, sink);
  if (!bytes) return std::nullopt;
  trajectories.hashes = {hash_bytes(bytes->data(), bytes->size())};
  trajectories.cost_s = stored_cost(trajectories.path, trajectories.hashes.front(), where, sink);
  if (sink.has_errors()) return std::nullopt;
  try {
    const NetcdfReader reader(std::move(*bytes), trajectories.path);
    Reader file_of_problem(problem, wanted, reader, trajectories);
    file_of_problem.read();
    file_of_problem.compare_params(where, sink);
  } catch (const Error& error) {
    sink.report("bad-array-file", where, {trajectories.path, error.what()});
    return std::nullopt;
  }
  return trajectories;
}

std::vector<const model::Datum*> data_with_values(const model::Problem& problem) {
  std::vector<const model::Datum*> data;
  for (const model::Datum& datum : problem.task->data) {
    if (datum.trajectories && !datum.begins_windows()) data.push_back(&datum);
  }
  return data;
}

/// Value for a run; nullopt if the file does not have it.
std::optional<double> param_of(const Trajectories& from, std::size_t run, const std::string& name) {
  const auto number = from.numbers.find(name);
  if (number != from.numbers.end()) return number->second;
  const auto param = std::ranges::find(from.params, name);
  if (param == from.params.end()) return std::nullopt;
  return from.runs[run].params[static_cast<std::size_t>(param - from.params.begin())];
}

std::string text_of_param(std::optional<double> value) { return value ? fmt::format("{}", *value) : "none"; }

/// Describes parameters that differ between the files; run-dependent ones may be in one file only.
std::string other_params(const Trajectories& own, const Trajectories& other) {
  std::set<std::string> names(own.params.begin(), own.params.end());
  names.insert(other.params.begin(), other.params.end());
  for (const auto& [name, value] : own.numbers) {
    if (other.numbers.contains(name)) names.insert(name);
  }
  for (const std::string& name : names) {
    const bool is_told = std::ranges::find(other.params, name) != other.params.end() || other.numbers.contains(name);
    for (std::size_t r = 0; is_told && r < own.runs.size(); ++r) {
      const std::optional<double> here = param_of(own, r, name), there = param_of(other, r, name);
      if (here != there)
        return fmt::format("its run {} has {} = {}, that of {} has {}", r, name, text_of_param(there), own.path,
                           text_of_param(here));
    }
  }
  return "";
}

/// Why data of `other` do not fit the samples of `own`; "" if they do.
std::string misfit(const Trajectories& own, const Trajectories& other) {
  if (other.runs.size() != own.runs.size())
    return fmt::format("it has {}, {} has {}", count_of(std::ssize(other.runs), "run"), own.path, own.runs.size());
  if (other.has_frames_of_data) {
    if (other.frame_count() != own.frame_count())
      return fmt::format("it has {}, {} has {}", count_of(other.frame_count(), "frame"), own.path, own.frame_count());
    for (std::size_t k = 0; k < own.times.size(); ++k) {
      if (std::abs(other.times[k] - own.times[k]) > 1e-6 * std::abs(own.times.back() - own.times.front()))
        return fmt::format("its frame {} is at t = {:.6g}, that of {} at {:.6g}", k, other.times[k], own.path,
                           own.times[k]);
    }
  }
  return other_params(own, other);
}

/// Adds the data of another file under unused names.
void join(Trajectories& own, const Trajectories& other, const Wanted& wanted) {
  for (const model::Datum* datum : wanted.data) {
    const std::string name = fmt::format("{} of {}", datum->variable, other.path);
    own.names_of_data[datum->name] = name;
    if (other.is_goal(datum->variable) && !own.is_goal(name)) own.goals.push_back(name);
    for (std::size_t r = 0; r < own.runs.size(); ++r)
      own.runs[r].frames[name] = other.runs[r].frames.at(datum->variable);
  }
  own.has_frames_of_data = own.has_frames_of_data || other.has_frames_of_data;
  own.looks = own.has_frames_of_data ? own.every : 1;
  own.hashes.insert(own.hashes.end(), other.hashes.begin(), other.hashes.end());
  own.cost_s += other.cost_s;
}

}  // namespace

std::optional<Trajectories> load_trajectories(const model::Problem& problem, const std::string& file,
                                              const SourceFile& source, SourceRange where, DiagnosticSink& sink) {
  return load(problem, {data_with_values(problem)}, file, source, where, sink);
}

std::optional<Trajectories> load_learnt_trajectories(const model::Problem& problem, const SourceFile& source,
                                                     DiagnosticSink& sink) {
  const model::Datum& windows = *problem.task->datum_of_windows();
  std::map<std::string, Wanted> others;
  Wanted own;
  for (const model::Datum* datum : data_with_values(problem)) {
    if (datum->file == windows.file) {
      own.data.push_back(datum);
    } else {
      others[datum->file].data.push_back(datum);
    }
  }
  std::optional<Trajectories> all = load(problem, own, windows.file, source, windows.origin.range, sink);
  for (auto& [file, wanted] : others) {
    if (!all) return std::nullopt;
    wanted.windows = &*all;
    const SourceRange where = wanted.data.front()->origin.range;
    const std::optional<Trajectories> other = load(problem, wanted, file, source, where, sink);
    if (!other) return std::nullopt;
    const std::string why = misfit(*all, *other);
    if (!why.empty()) {
      sink.report("bad-array-file", where, {other->path, why});
      return std::nullopt;
    }
    join(*all, *other, wanted);
  }
  return all;
}

}  // namespace dpde::files
