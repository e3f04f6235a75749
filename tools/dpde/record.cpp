// SPDX-License-Identifier: Apache-2.0
#include "record.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <numeric>

#include "driver/restart_file.h"

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

std::string Record::plan() const {
  std::string plan;
  for (const Series& series : series_) {
    plan += fmt::format("{}{} every {} steps", plan.empty() ? "" : "; ", fmt::join(series.fields, ", "), series.every);
  }
  return plan;
}

std::string Record::bytes() const {
  driver::ByteWriter out;
  for (const Series& series : series_) {
    out.values({series.steps.begin(), series.steps.end()});
    out.values(series.times);
    for (const std::string& field : series.fields) out.values(series.values.contains(field) ? series.values.at(field) : std::vector<double>{});
    for (const auto& row : series.observables) {
      for (const auto& [name, value] : row) out.values({value});
    }
  }
  return out.bytes();
}

/// The last state of a run that was shorter is none of this run's.
void Record::drop_former_end(Series& series) const {
  if (series.steps.empty()) return;
  const int last = series.steps.back();
  if (last == 0 || last == session_.steps() || (series.every > 0 && last % series.every == 0)) return;
  series.steps.pop_back();
  series.times.pop_back();
  series.observables.pop_back();
  for (auto& [field, values] : series.values) values.resize(series.steps.size() * (keeps_states_ ? session_.workspace().cell_count() : 0));
}

bool Record::restore(std::string_view bytes) {
  driver::ByteReader in(bytes);
  for (Series& series : series_) {
    const std::vector<double> steps = in.values();
    series.steps.assign(steps.begin(), steps.end());
    series.times = in.values();
    const std::size_t wanted = keeps_states_ ? steps.size() * session_.workspace().cell_count() : 0;
    bool fits = series.times.size() == steps.size();
    for (const std::string& field : series.fields) {
      series.values[field] = in.values();
      fits = fits && series.values[field].size() == wanted;
    }
    if (!fits) return false;
    for (std::size_t k = 0; k < steps.size(); ++k) {
      auto& row = series.observables.emplace_back();
      for (const model::Quantity& quantity : session_.problem().observables) {
        const std::vector<double> value = in.values();
        if (value.size() != 1) return false;
        row.emplace_back(quantity.name, value[0]);
      }
    }
    drop_former_end(series);
  }
  return in.is_done();
}

void Record::look(const Snapshot& snapshot) {
  for (Series& series : series_) {
    if (!series.steps.empty() && series.steps.back() >= snapshot.step) continue;  // of before a restart
    const bool is_end = snapshot.step == 0 || snapshot.step == session_.steps();
    if (is_end || (series.every > 0 && snapshot.step % series.every == 0)) add(series, snapshot);
  }
}

void Record::look_at_end(int step, const std::vector<void*>& states) {
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
