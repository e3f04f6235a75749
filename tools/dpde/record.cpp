// SPDX-License-Identifier: Apache-2.0
#include "record.h"

#include <numeric>

namespace dpde::tools {

Record::Record(driver::Session& session, int every, bool keeps_states) : session_(session), keeps_states_(keeps_states) {
  std::vector<std::string> all;
  for (int s = 0; s < session.rollout().state_count(); ++s) all.push_back(session.rollout().state_name(s));
  if (every == 0) {
    for (const model::Output& output : session.problem().outputs) series_.push_back({output.fields, output.every, {}, {}, {}, {}});
  }
  if (series_.empty()) series_.push_back({all, every, {}, {}, {}, {}});
}

int Record::interval() const {
  int interval = 0;
  for (const Series& series : series_) interval = std::gcd(interval, series.every);
  return interval;
}

void Record::look(const Snapshot& snapshot) {
  for (Series& series : series_) {
    const bool is_end = snapshot.step == 0 || snapshot.step == session_.steps();
    if (is_end || (series.every > 0 && snapshot.step % series.every == 0)) add(series, snapshot);
  }
}

void Record::look_at_end(int step, const std::vector<double*>& states) {
  for (Series& series : series_) {
    if (series.steps.empty() || series.steps.back() != step) add(series, {step, session_.time_of(step), states});
  }
}

void Record::add(Series& series, const Snapshot& snapshot) {
  series.steps.push_back(snapshot.step);
  series.times.push_back(snapshot.t);
  series.observables.push_back(session_.observe(snapshot.t, snapshot.states));
  if (!keeps_states_) return;
  std::vector<double> values(session_.workspace().cell_count());
  for (const std::string& field : series.fields) {
    const int state = session_.rollout().state_index(field);
    copy_out(session_.workspace().layout(), snapshot.states[static_cast<std::size_t>(state)], values);
    std::vector<double>& all = series.values[field];
    all.insert(all.end(), values.begin(), values.end());
  }
}

}  // namespace dpde::tools
