// SPDX-License-Identifier: Apache-2.0
#include "dpde/recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "dpde/runtime/atomic_file.h"
#include "dpde/runtime/npy.h"
#include "dpde/runtime/run_file.h"
#include "host/run_restart.h"

namespace dpde {

namespace {

namespace fs = std::filesystem;

fs::path made_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder))
    throw Error(ErrorKind::machine, fmt::format("cannot make the folder {}: {}", folder.string(),
                                                error ? error.message() : std::strerror(ENOTDIR)));
  return folder;
}

int checked_interval(int every) {
  if (every < 0)
    throw Error(ErrorKind::input, fmt::format("states of every {} steps cannot be recorded: take 1 or more, or 0 for "
                                              "the outputs of the scene",
                                              every));
  return every;
}

std::shared_ptr<const RunDescription> description_of(const Simulation& simulation) {
  if (simulation.description() == nullptr)
    throw Error(ErrorKind::input,
                "only scenes that were compiled in this program can be recorded: dpde build keeps no "
                "description for the files");
  return simulation.description();
}

/// A recorded run of a simulation. `restart`: folder of its checkpoints.
struct Recorded {
  Recorded(const Simulation& simulation, const RunDescription& run, const fs::path& restart, int every)
      : frames(restart),
        record(record_plan(simulation.states(), every, run.outputs), names_of(run.observables), simulation.size(),
               &frames) {}

  static std::vector<std::string> names_of(const std::vector<RunNumber>& numbers) {
    std::vector<std::string> names;
    for (const RunNumber& number : numbers) names.push_back(number.name);
    return names;
  }

  FrameFile frames;
  RunRecord record;
  int seen = -1;         // last step that was checked
  int checkpointed = 0;  // step of the last checkpoint
};

}  // namespace

struct Recorder::Impl {
  Impl(Simulation& of, const fs::path& where, int interval)
      : simulation(of),
        run(description_of(of)),
        every(checked_interval(interval)),
        folder(made_folder(where)),
        outputs(of.outputs()) {}

  std::unique_ptr<Recorded> begun() const { return std::make_unique<Recorded>(simulation, *run, restart(), every); }
  Recorded& recorded() {
    if (!now) now = begun();
    return *now;
  }

  /// Whether all states are finite; other states are not recorded.
  bool has_finite_states() const {
    return std::ranges::all_of(simulation.states(), [&](const std::string& name) {
      return std::ranges::all_of(simulation.state(name), [](double value) { return std::isfinite(value); });
    });
  }
  std::map<std::string, std::vector<double>> present_outputs() const {
    std::map<std::string, std::vector<double>> values;
    std::vector<std::vector<double>> all = simulation.output_values();
    for (std::size_t n = 0; n < all.size(); ++n) values.emplace(outputs[n], std::move(all[n]));
    return values;
  }

  void add(std::size_t series) {
    RunRecord& record = recorded().record;
    const std::vector<std::string>& fields = record.series()[series].fields;
    const auto is_output = [&](const std::string& name) { return std::ranges::find(outputs, name) != outputs.end(); };
    std::map<std::string, std::vector<double>> of_formulas;
    if (std::ranges::any_of(fields, is_output)) of_formulas = present_outputs();
    std::vector<double> frame;
    for (const std::string& name : fields) {
      const std::vector<double> values = is_output(name) ? std::move(of_formulas.at(name)) : simulation.state(name);
      frame.insert(frame.end(), values.begin(), values.end());
    }
    Observed observed;
    for (const RunNumber& number : run->observables)
      observed.emplace_back(number.name, simulation.observe(number.name));
    record.add(series, simulation.steps_done(), simulation.time(), std::move(observed), frame);
  }

  void look(bool is_first_or_last) {
    Recorded& own = recorded();
    const int step = simulation.steps_done();
    if (own.seen > step) throw Error(ErrorKind::input, "a record is of one run: finish it before another one begins");
    own.seen = step;
    std::vector<std::size_t> due;
    for (std::size_t s = 0; s < own.record.series().size(); ++s) {
      if (own.record.is_due(s, step, is_first_or_last)) due.push_back(s);
    }
    if (due.empty() || !has_finite_states()) return;
    for (const std::size_t s : due) add(s);
  }
  /// Called before a run.
  void look_at_start() { look(recorded().seen < 0); }
  void look_on_the_way() {
    look(false);
    const int step = simulation.steps_done();
    const bool is_due = checkpoint_every > 0 && step > recorded().checkpointed && step % checkpoint_every == 0;
    if (!is_due || !failure.empty()) return;
    try {
      checkpoint();
    } catch (const Error& error) {  // a full disk does not end the run
      failure = error.what();
    }
  }

  fs::path restart() const { return folder / (run->scene + ".restart"); }
  bool checkpoint() {
    if (!host::save_run(restart(), simulation, description(), recorded().record, recorded().frames)) return false;
    recorded().checkpointed = simulation.steps_done();
    return true;
  }
  bool resume() {
    std::unique_ptr<Recorded> resumed = begun();
    if (!host::resume_run(restart(), simulation, description(), resumed->record)) return false;
    resumed->seen = resumed->checkpointed = simulation.steps_done();
    now = std::move(resumed);
    return true;
  }

  /// Greatest common interval of recorded states and checkpoints; 0: only the first and last state.
  int interval() { return std::gcd(recorded().record.interval(), checkpoint_every); }
  /// Steps to the next one, at most `count`.
  int steps_to_next(int count) {
    const int interval = this->interval();
    return interval == 0 ? count : std::min(count, interval - simulation.steps_done() % interval);
  }

  /// Calls `advance` with a callback for all steps that the caller or the recorder needs. The caller's steps count from
  /// the beginning of the call, the recorder's from the start of the run.
  bool watched(const ProgressCallback& progress, int interval,
               const std::function<bool(const ProgressCallback&, int)>& advance) {
    look_at_start();
    interval = std::max(interval, 1);
    const int every = this->interval();
    if (every == 0) return advance(progress, interval);
    const int common = std::gcd(std::gcd(progress ? interval : 0, every), simulation.steps_done() % every);
    const auto call = [&](const Progress& at) {
      look_on_the_way();
      return !progress || (at.step % interval != 0 && at.step != at.steps) || progress(at);
    };
    return advance(call, common);
  }

  RunDescription description() const {
    RunDescription present = *run;
    const std::vector<std::string> settable = simulation.params();
    for (RunNumber& param : present.params) {
      if (std::ranges::find(settable, param.name) != settable.end()) param.value = simulation.param(param.name);
    }
    return present;
  }

  /// `is_present`: the simulation is still at the end of the run, with finite states.
  std::vector<std::string> write(const RunRecord& record, bool is_present) const {
    std::vector<std::string> names;
    const auto named = [&](const std::string& name) { return folder / names.emplace_back(name); };
    const RunDescription described = description();
    const Series& first = record.series()[0];
    const auto is_known = [&](const std::string& field) { return is_present || record.last_state(field).has_value(); };
    RunEnd end;
    for (const Series& series : record.series()) end.time = std::max(end.time, series.times.back());
    std::map<std::string, std::vector<double>> of_formulas;
    if (is_present) of_formulas = present_outputs();
    std::ranges::copy_if(simulation.states(), std::back_inserter(end.states), is_known);
    std::ranges::copy_if(outputs, std::back_inserter(end.outputs), is_known);
    std::ranges::sort(end.outputs);
    end.at_end = [&](const std::string& field) {
      const std::optional<std::vector<double>> kept = record.last_state(field);
      const auto output = of_formulas.find(field);
      return kept ? *kept : output != of_formulas.end() ? output->second : simulation.state(field);
    };
    end.at_start = [&](const std::string& field) {
      for (const Series& series : record.series()) {
        if (std::ranges::find(series.fields, field) != series.fields.end()) return record.states(series, field, 0, 1);
      }
      return simulation.initial(field);
    };
    for (const std::string& field : end.states) write_state(named(field + ".npy"), described, end.at_end(field));
    for (const std::string& field : end.outputs) write_state(named(field + ".npy"), described, end.at_end(field));
    for (const std::string& field : every > 0 ? first.fields : std::vector<std::string>{})
      write_states(named(field + "_over_time.npy"), described, record, first, field);
    if (every > 0) write_file_atomically(named("observables.csv"), table_of(first));
    write_run(named(run->scene + ".nc"), described, record);
    if (run->axes.size() == 3)
      write_file_atomically(named(run->scene + ".xdmf"), xdmf_of(run->scene + ".nc", described, record));
    if (run->draw) {
      for (std::string& picture : run->draw(folder, record, end)) names.push_back(std::move(picture));
    }
    return names;
  }

  Simulation& simulation;
  std::shared_ptr<const RunDescription> run;
  int every;
  fs::path folder;
  std::vector<std::string> outputs;  // outputs with a formula, in the order of the simulation
  std::unique_ptr<Recorded> now;
  int checkpoint_every = 0;  // steps; 0: never
  std::string failure;       // of a checkpoint during the run
};

Recorder::Recorder(Simulation& simulation, const std::string& folder, int every)
    : impl_(std::make_unique<Impl>(simulation, folder, every)) {}
Recorder::~Recorder() = default;
Recorder::Recorder(Recorder&&) noexcept = default;
Recorder& Recorder::operator=(Recorder&&) noexcept = default;

bool Recorder::step(int count) {
  Impl& impl = *impl_;
  impl.look_at_start();
  while (count > 0) {
    const int now = impl.steps_to_next(count);
    if (!impl.simulation.step(now)) return false;
    impl.look_on_the_way();
    count -= now;
  }
  return true;
}

bool Recorder::run_to(double time, const ProgressCallback& progress, int every) {
  return impl_->watched(progress, every, [&](const ProgressCallback& call, int interval) {
    return impl_->simulation.run_to(time, call, interval);
  });
}

bool Recorder::run(const ProgressCallback& progress, int every) {
  return impl_->watched(progress, every, [&](const ProgressCallback& call, int interval) {
    return impl_->simulation.run(call, interval);
  });
}

void Recorder::checkpoint() {
  impl_->look_at_start();
  if (!impl_->checkpoint()) throw Error(ErrorKind::run, "nothing goes on from states that are not finite");
}
void Recorder::checkpoint_every(int steps) {
  if (steps < 0) throw Error(ErrorKind::input, fmt::format("no checkpoint is made every {} steps", steps));
  impl_->checkpoint_every = steps;
}
bool Recorder::resume() {
  if (impl_->now && impl_->now->seen >= 0)
    throw Error(ErrorKind::input, "a record that holds states already cannot go on from others: resume first");
  return impl_->resume();
}

std::vector<std::string> Recorder::finish() {
  bool is_present = impl_->recorded().seen <= impl_->simulation.steps_done();  // or a new run began after it
  try {
    if (is_present) impl_->look(true);
    is_present = is_present && impl_->has_finite_states();
  } catch (const NotFinite&) {  // what was recorded before is written
    is_present = false;
  }
  const std::unique_ptr<Recorded> recorded = std::move(impl_->now);
  const std::string& failure = recorded->record.failure();
  if (!failure.empty()) throw Error(ErrorKind::machine, failure);
  if (std::ranges::all_of(recorded->record.series(), [](const Series& series) { return series.steps.empty(); }))
    return {};
  std::vector<std::string> names = impl_->write(recorded->record, is_present);
  const std::string no_checkpoint = std::exchange(impl_->failure, "");
  if (!no_checkpoint.empty()) throw Error(ErrorKind::machine, no_checkpoint);
  return names;
}

}  // namespace dpde
