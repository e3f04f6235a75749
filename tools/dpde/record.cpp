// SPDX-License-Identifier: Apache-2.0
#include "record.h"

#include <algorithm>

#include "driver/report/run_description.h"

namespace dpde::tools {

namespace {

std::vector<Series> plan_of(driver::Session& session, int every) {
  std::vector<std::string> all;
  for (int s = 0; s < session.rollout().state_count(); ++s) all.push_back(session.rollout().state_name(s));
  return record_plan(all, every, driver::run_outputs(session.problem()));
}

std::vector<std::string> observables_of(const model::Problem& problem) {
  std::vector<std::string> names;
  for (const model::Quantity& quantity : problem.observables) names.push_back(quantity.name);
  return names;
}

}  // namespace

Record::Record(driver::Session& session, int every, FrameFile* frames)
    : session_(session),
      record_(plan_of(session, every), observables_of(session.problem()), session.workspace().cell_count(), frames) {}

void Record::drop_former_end(std::size_t index) {
  const Series& series = record_.series()[index];
  if (series.steps.empty()) return;
  const int last = series.steps.back();
  if (last == 0 || last == session_.steps() || (series.every > 0 && last % series.every == 0)) return;
  record_.drop_last(index);
}

bool Record::restore(std::string_view bytes) {
  if (!record_.restore(bytes)) return false;
  for (std::size_t s = 0; s < record_.series().size(); ++s) drop_former_end(s);
  return true;
}

void Record::renew(int step, const std::vector<void*>& states) {
  for (std::size_t s = 0; s < record_.series().size(); ++s) {
    const Series& series = record_.series()[s];
    if (series.steps.empty() || series.steps.back() != step) continue;
    const bool has_shown = std::ranges::any_of(series.fields, [&](const std::string& f) { return is_shown(f); });
    std::vector<double> frame;
    if (has_shown && record_.keeps_states()) frame = frame_of(series, {step, session_.time_of(step), states});
    record_.renew(s, session_.observe(session_.time_of(step), states), frame);
  }
}

void Record::look(const Snapshot& snapshot) {
  for (std::size_t s = 0; s < record_.series().size(); ++s) {
    if (record_.is_due(s, snapshot.step, snapshot.is_last)) add(s, snapshot);
  }
}

void Record::look_at_end(int step, const std::vector<void*>& states) {
  for (std::size_t s = 0; s < record_.series().size(); ++s) {
    const std::vector<int>& steps = record_.series()[s].steps;
    while (!steps.empty() && steps.back() > step) record_.drop_last(s);  // states that were not finite
    if (steps.empty() || steps.back() != step) add(s, {step, session_.time_of(step), states});
  }
}

void Record::add(std::size_t index, const Snapshot& snapshot) {
  std::vector<double> frame;
  if (record_.keeps_states()) frame = frame_of(record_.series()[index], snapshot);
  record_.add(index, snapshot.step, snapshot.t, session_.observe(snapshot.t, snapshot.states), frame);
}

std::vector<double> Record::frame_of(const Series& series, const Snapshot& snapshot) {
  const std::size_t cells = session_.workspace().cell_count();
  std::map<std::string, std::vector<double>> shown;
  if (std::ranges::any_of(series.fields, [&](const std::string& field) { return is_shown(field); }))
    shown = session_.shown(snapshot.t, snapshot.states);
  std::vector<double> frame(series.fields.size() * cells);
  for (std::size_t f = 0; f < series.fields.size(); ++f) {
    const std::string& field = series.fields[f];
    const std::span<double> values(frame.data() + f * cells, cells);
    if (is_shown(field)) {
      std::ranges::copy(shown.at(field), values.begin());
    } else {
      const int state = session_.rollout().state_index(field);
      copy_out(session_.workspace().layout(), snapshot.states[static_cast<std::size_t>(state)], values);
    }
  }
  return frame;
}

}  // namespace dpde::tools
