// SPDX-License-Identifier: Apache-2.0
#include "run_checkpoint.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "dpde/runtime/error.h"

namespace dpde::tools {

std::optional<CheckpointInterval> parse_interval(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || !(value > 0) || value > 1e9) return std::nullopt;
  const std::string unit(end, text.data() + text.size());
  if (unit.empty() && value == static_cast<int>(value)) return CheckpointInterval{static_cast<int>(value), 0};
  const double seconds = unit == "s" ? 1 : unit == "min" ? 60 : unit == "h" ? 3600 : 0;
  return seconds > 0 ? std::optional(CheckpointInterval{0, value * seconds}) : std::nullopt;
}

std::filesystem::path RunCheckpoint::path_of(const Job& job, const driver::Session& session) {
  return std::filesystem::path(job.options().out) / (session.problem().scene + ".restart");
}

RunCheckpoint::RunCheckpoint(Job& job, driver::Session& session, Record& record, FrameFile& frames,
                             CheckpointInterval interval)
    : job_(job),
      session_(session),
      record_(record),
      interval_(interval),
      path_(path_of(job, session)),
      identity_(driver::identity_of(session)),
      frames_(frames) {
  identity_.emplace_back("output", record.kept().plan());
}

std::optional<int> RunCheckpoint::resume() {
  std::error_code error;
  if (!std::filesystem::exists(path_, error)) {
    job_.tell(fmt::format("there is no {} yet: the run starts at its beginning", path_.string()));
    return 0;
  }
  const std::optional<driver::Restart> restart = driver::load_restart(path_, identity_, job_.sink());
  if (!restart) return std::nullopt;
  const std::size_t cells = session_.workspace().cell_count();
  bool fits =
      restart->states.size() == static_cast<std::size_t>(session_.rollout().state_count()) && restart->step >= 0;
  for (const std::vector<double>& state : restart->states) fits = fits && state.size() == cells;
  std::string reason = "it is damaged";
  try {
    fits = fits && record_.restore(restart->record);
  } catch (const Error& error) {
    fits = false;
    reason = error.what();
  }
  if (!fits) {
    job_.sink().report("bad-array-file", {}, {path_.string(), reason});
    return std::nullopt;
  }
  if (restart->step > session_.steps()) {
    job_.sink().report(
        "restart-differs", {}, {path_.string(), "end"},
        fmt::format("it has reached step {}, this run ends at step {}", restart->step, session_.steps()));
    return std::nullopt;
  }
  std::vector<void*> states;
  for (std::size_t s = 0; s < restart->states.size(); ++s) {
    Field& initial = session_.rollout().initial(static_cast<int>(s));
    initial.copy_in(restart->states[s]);
    states.push_back(initial.base());
  }
  record_.renew(restart->step, states);
  session_.rollout().set_controller(restart->controller);
  last_step_ = restart->step;
  job_.say(fmt::format("goes on from step {} of {}\n", restart->step, session_.steps()));
  return restart->step;
}

void RunCheckpoint::look(const Snapshot& snapshot) {
  const bool is_of_end = snapshot.is_last && session_.is_until_steady();  // handled by the run
  if (snapshot.step == last_step_ || is_of_end) return;
  const bool step_is_due = interval_.steps > 0 && snapshot.step % interval_.steps == 0;
  const std::chrono::duration<double> since = std::chrono::steady_clock::now() - last_time_;
  if (step_is_due || (interval_.seconds > 0 && since.count() >= interval_.seconds))
    save(snapshot.step, snapshot.states);
}

void RunCheckpoint::save(int step, const std::vector<void*>& states) {
  const bool is_saved = guarded(job_, [&] {
    driver::Restart restart{identity_, step, {}, session_.rollout().controller(), {}};
    for (void* state : states) {
      std::vector<double>& values = restart.states.emplace_back(session_.workspace().cell_count());
      copy_out(session_.workspace().layout(), state, values);
      if (!std::ranges::all_of(values, [](double value) { return std::isfinite(value); })) return;  // the run will end
    }
    restart.record = record_.save();
    if (driver::save_restart(path_, restart, job_.sink())) frames_.remove_others();
  });
  if (!is_saved || job_.failed()) interval_ = {};  // one message is enough
  last_step_ = step;
  last_time_ = std::chrono::steady_clock::now();
}

}  // namespace dpde::tools
