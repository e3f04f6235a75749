// SPDX-License-Identifier: Apache-2.0
#include "driver/scene/window_start.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "files/files.h"
#include "files/trajectories.h"

namespace dpde::driver {

namespace {

const model::Datum* datum_of_windows(const Compiled& compiled) {
  if (!compiled.problem || !compiled.problem->task) return nullptr;
  return compiled.problem->task->datum_of_windows();
}

/// Names a state of past steps that the file does not contain; "" if there is none.
std::string missing_memory(const model::Problem& problem, const files::Trajectories& from) {
  const auto is_missing = [&](const model::State& state) {
    return !state.history_of.empty() && !state.is_guess &&
           std::ranges::find(from.states, state.name) == from.states.end();
  };
  const auto state = std::ranges::find_if(problem.states, is_missing);
  return state == problem.states.end() ? "" : fmt::format("{} has no {}", from.path, state->name);
}

std::string first_error_of(const DiagnosticSink& sink) {
  const auto error =
      std::ranges::find_if(sink.all(), [](const Diagnostic& one) { return one.kind->severity == Severity::error; });
  return error == sink.all().end() ? "" : error->message;
}

/// First frame that is not 0 everywhere, since a zero state says little of derivatives; else frame 0.
int first_frame(const files::Trajectories& from, int frames) {
  const auto is_zero = [&](int frame) {
    return std::ranges::all_of(from.states, [&](const std::string& state) {
      return std::ranges::all_of(from.frames(0, state, frame), [](double value) { return value == 0; });
    });
  };
  int frame = 0;
  while (frame + frames < from.frame_count() && is_zero(frame)) ++frame;
  return frame + frames < from.frame_count() ? frame : 0;
}

WindowStart begin_of(const model::Problem& problem, const files::Trajectories& from, int frames) {
  WindowStart start{from.path, 0, first_frame(from, frames), 0, from.looks, from.cells, {}, {}, {}};
  start.t = from.times[static_cast<std::size_t>(start.frame)];
  const auto take = [&](const std::string& variable, int first, int count) {
    const auto values = from.frames(start.run, variable, first, count);
    return std::vector<double>(values.begin(), values.end());
  };
  for (const std::string& state : from.states) start.states[state] = take(state, start.frame, 1);
  for (std::size_t p = 0; p < from.params.size(); ++p) start.params[from.params[p]] = from.runs.front().params[p];
  for (const model::Datum& datum : problem.task->data) {
    if (!datum.trajectories || datum.begins_windows()) continue;
    const std::string& name = from.name_of(datum);
    start.data[datum.name] = from.is_goal(name) ? take(name, 0, 1) : take(name, start.frame + 1, frames);
  }
  return start;
}

}  // namespace

int WindowStart::whole_frames(int steps) const { return std::max(every, steps - steps % every); }

FirstWindow first_window(const Compiled& compiled, const SourceFile& source) {
  const model::Datum* datum = datum_of_windows(compiled);
  if (datum == nullptr) return {};
  const model::Problem& problem = *compiled.problem;
  DiagnosticSink silent;
  const std::optional<files::Trajectories> from = files::load_learnt_trajectories(problem, source, silent);
  if (!from) return {nullptr, first_error_of(silent)};
  const int frames = from->has_frames_of_data ? problem.steps / from->every : 0;
  if (problem.steps % from->looks != 0 || from->frame_count() <= frames)
    return {nullptr, fmt::format("{} has no window of {} steps: its {} frames are {} steps apart", from->path,
                                 problem.steps, from->frame_count(), from->every)};
  const std::string missing = missing_memory(problem, *from);
  if (!missing.empty()) return {nullptr, missing};
  return {std::make_shared<const WindowStart>(begin_of(problem, *from, frames)), ""};
}

std::string text_of(const WindowStart& start) {
  return fmt::format("from frame {} of run {} of {} (t = {:.6g})", start.frame, start.run, start.path, start.t);
}

std::string stamp_of_windows(const Compiled& compiled, const SourceFile& source) {
  const model::Datum* datum = datum_of_windows(compiled);
  if (datum == nullptr) return "";
  std::string stamp;
  for (const model::Datum& each : compiled.problem->task->data) {
    const std::filesystem::path path = files::find_data_file(each.file, source.path());
    std::error_code error;
    const auto size = std::filesystem::file_size(path, error);
    if (error) return "no file";
    const auto changed = std::filesystem::last_write_time(path, error).time_since_epoch().count();
    stamp += fmt::format("{} {} {} ", path.string(), size, changed);
  }
  return stamp;
}

}  // namespace dpde::driver
