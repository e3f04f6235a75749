// SPDX-License-Identifier: Apache-2.0
#include "record.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>

#include "driver/restart_file.h"

namespace dpde::tools {

Record::Record(driver::Session& session, int every, bool keeps_states)
    : session_(session), keeps_states_(keeps_states) {
  std::vector<std::string> all;
  for (int s = 0; s < session.rollout().state_count(); ++s) all.push_back(session.rollout().state_name(s));
  if (every == 0) {
    for (const model::Output& output : session.problem().outputs)
      series_.push_back({output.fields, output.every, {}, {}, {}, {}});
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

std::string Record::save(FrameFile& frames) {
  const std::size_t cells = session_.workspace().cell_count();
  for (; keeps_states_ && saved_ < entries_.size(); ++saved_) {
    const Entry entry = entries_[saved_];
    const Series& series = series_[static_cast<std::size_t>(entry.series)];
    std::vector<double> frame;
    for (const std::string& field : series.fields) {
      const auto begin = series.values.at(field).begin() +
                         static_cast<std::ptrdiff_t>(static_cast<std::size_t>(entry.instant) * cells);
      frame.insert(frame.end(), begin, begin + static_cast<std::ptrdiff_t>(cells));
    }
    frames.append(frame);
  }
  const FrameMark mark = frames.sync();
  driver::ByteWriter out;
  out.text(mark.file);
  out.number(mark.bytes);
  out.number(static_cast<std::int64_t>(mark.checksum));
  out.number(static_cast<std::int64_t>(entries_.size()));
  for (const Entry& entry : entries_) {
    out.number(entry.series);
    out.number(entry.instant);
  }
  for (const Series& series : series_) {
    out.values({series.steps.begin(), series.steps.end()});
    out.values(series.times);
    for (const auto& row : series.observables) {
      for (const auto& [name, value] : row) out.values({value});
    }
  }
  return out.bytes();
}

/// The last state of a run that was shorter is none of this run's.
void Record::drop_former_end(int index) {
  Series& series = series_[static_cast<std::size_t>(index)];
  if (series.steps.empty()) return;
  const int last = series.steps.back();
  if (last == 0 || last == session_.steps() || (series.every > 0 && last % series.every == 0)) return;
  series.steps.pop_back();
  series.times.pop_back();
  series.observables.pop_back();
  for (auto& [field, values] : series.values)
    values.resize(series.steps.size() * (keeps_states_ ? session_.workspace().cell_count() : 0));
  for (Entry& entry : entries_) {
    if (entry.series == index && entry.instant == static_cast<int>(series.steps.size())) entry.instant = -1;
  }
}

bool Record::restore(std::string_view bytes, FrameFile& frames) {
  driver::ByteReader in(bytes);
  FrameMark mark;
  mark.file = in.text();
  mark.bytes = in.number();
  mark.checksum = static_cast<std::uint64_t>(in.number());
  for (std::int64_t n = in.number(); n > 0 && in.is_fine(); --n) {
    const std::int64_t series = in.number(), instant = in.number();
    if (series < 0 || series >= static_cast<std::int64_t>(series_.size())) return false;
    entries_.push_back({static_cast<int>(series), static_cast<int>(instant)});
  }
  for (Series& series : series_) {
    if (!restore_series(series, in)) return false;
  }
  if (!in.is_done() || !restore_states(frames.reopen(mark))) return false;
  saved_ = entries_.size();
  for (std::size_t s = 0; s < series_.size(); ++s) drop_former_end(static_cast<int>(s));
  return true;
}

bool Record::restore_series(Series& series, driver::ByteReader& in) {
  const std::vector<double> steps = in.values();
  series.steps.assign(steps.begin(), steps.end());
  series.times = in.values();
  if (series.times.size() != steps.size()) return false;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    auto& row = series.observables.emplace_back();
    for (const model::Quantity& quantity : session_.problem().observables) {
      const std::vector<double> value = in.values();
      if (value.size() != 1) return false;
      row.emplace_back(quantity.name, value[0]);
    }
  }
  return true;
}

/// In the order of the entries, each with all fields of its series; those of dropped instants are passed over.
bool Record::restore_states(std::span<const double> states) {
  const std::size_t cells = keeps_states_ ? session_.workspace().cell_count() : 0;
  for (const Entry& entry : entries_) {
    Series& series = series_[static_cast<std::size_t>(entry.series)];
    for (const std::string& field : series.fields) {
      if (states.size() < cells) return false;
      std::vector<double>& all = series.values[field];
      if (entry.instant >= 0)
        all.insert(all.end(), states.begin(), states.begin() + static_cast<std::ptrdiff_t>(cells));
      states = states.subspan(cells);
    }
  }
  for (const Series& series : series_) {
    for (const std::string& field : series.fields) {
      if (!series.values.contains(field) || series.values.at(field).size() != series.steps.size() * cells) return false;
    }
  }
  return states.empty();
}

void Record::renew(int step, const std::vector<void*>& states) {
  for (std::size_t s = 0; s < series_.size(); ++s) {
    Series& series = series_[s];
    if (series.steps.empty() || series.steps.back() != step) continue;
    series.observables.back() = session_.observe(session_.time_of(step), states);
    if (keeps_states_) renew_shown(static_cast<int>(s), step, states);
  }
}

/// Of the last instant, whose states go into the file once more.
void Record::renew_shown(int index, int step, const std::vector<void*>& states) {
  Series& series = series_[static_cast<std::size_t>(index)];
  if (std::ranges::none_of(series.fields, [&](const std::string& field) { return is_shown(field); })) return;
  for (const auto& [name, values] : session_.shown(session_.time_of(step), states)) {
    const auto all = series.values.find(name);
    if (all != series.values.end())
      std::ranges::copy(values, all->second.end() - static_cast<std::ptrdiff_t>(values.size()));
  }
  const int last = static_cast<int>(series.steps.size()) - 1;
  for (Entry& entry : entries_) {
    if (entry.series == index && entry.instant == last) entry.instant = -1;
  }
  entries_.push_back({index, last});
}

void Record::look(const Snapshot& snapshot) {
  for (Series& series : series_) {
    if (!series.steps.empty() && series.steps.back() >= snapshot.step) continue;  // of before a restart
    const bool is_end = snapshot.step == 0 || snapshot.is_last;
    if (is_end || (series.every > 0 && snapshot.step % series.every == 0)) add(series, snapshot);
  }
}

void Record::look_at_end(int step, const std::vector<void*>& states) {
  for (Series& series : series_) {
    if (series.steps.empty() || series.steps.back() != step) add(series, {step, session_.time_of(step), states});
  }
}

void Record::add(Series& series, const Snapshot& snapshot) {
  entries_.push_back({static_cast<int>(&series - series_.data()), static_cast<int>(series.steps.size())});
  series.steps.push_back(snapshot.step);
  series.times.push_back(snapshot.t);
  series.observables.push_back(session_.observe(snapshot.t, snapshot.states));
  if (!keeps_states_) return;
  std::vector<double> values(session_.workspace().cell_count());
  std::map<std::string, std::vector<double>> shown;
  if (std::ranges::any_of(series.fields, [&](const std::string& field) { return is_shown(field); }))
    shown = session_.shown(snapshot.t, snapshot.states);
  for (const std::string& field : series.fields) {
    std::vector<double>& all = series.values[field];
    if (is_shown(field)) {
      all.insert(all.end(), shown.at(field).begin(), shown.at(field).end());
      continue;
    }
    const int state = session_.rollout().state_index(field);
    copy_out(session_.workspace().layout(), snapshot.states[static_cast<std::size_t>(state)], values);
    all.insert(all.end(), values.begin(), values.end());
  }
}

}  // namespace dpde::tools
