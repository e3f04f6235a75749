// SPDX-License-Identifier: Apache-2.0
#include "record.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>

#include "dpde/runtime/error.h"
#include "driver/restart_file.h"

namespace dpde::tools {

Record::Record(driver::Session& session, int every, FrameFile* frames) : session_(session), frames_(frames) {
  std::vector<std::string> all;
  for (int s = 0; s < session.rollout().state_count(); ++s) all.push_back(session.rollout().state_name(s));
  if (every == 0) {
    for (const model::Output& output : session.problem().outputs)
      series_.push_back({output.fields, output.every, {}, {}, {}});
  }
  if (series_.empty()) series_.push_back({all, every, {}, {}, {}});
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

std::string Record::save() {
  if (!failure_.empty()) throw Error(ErrorKind::machine, failure_);
  const FrameMark mark = frames_->sync();
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
  series.places.pop_back();
  for (Entry& entry : entries_) {
    if (entry.series == index && entry.instant == static_cast<int>(series.steps.size())) entry.instant = -1;
  }
}

bool Record::restore(std::string_view bytes) {
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
  if (!in.is_done()) return false;
  frames_->reopen(mark);
  const bool is_whole = restore_places() == frames_->count();
  if (!is_whole || std::ranges::any_of(series_, [](const Series& s) { return s.places.size() != s.steps.size(); }))
    return false;
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

/// In the order of the entries, each with all fields of its series; those of dropped instants are passed over. The
/// numbers of all.
std::int64_t Record::restore_places() {
  std::int64_t place = 0;
  for (const Entry& entry : entries_) {
    Series& series = series_[static_cast<std::size_t>(entry.series)];
    if (entry.instant == static_cast<int>(series.places.size())) series.places.push_back(place);
    place += numbers_of(series);
  }
  return place;
}

void Record::renew(int step, const std::vector<void*>& states) {
  for (std::size_t s = 0; s < series_.size(); ++s) {
    Series& series = series_[s];
    if (series.steps.empty() || series.steps.back() != step) continue;
    series.observables.back() = session_.observe(session_.time_of(step), states);
    if (frames_ != nullptr) renew_shown(static_cast<int>(s), step, states);
  }
}

/// Of the last instant, whose states go into the file once more.
void Record::renew_shown(int index, int step, const std::vector<void*>& states) {
  Series& series = series_[static_cast<std::size_t>(index)];
  if (std::ranges::none_of(series.fields, [&](const std::string& field) { return is_shown(field); })) return;
  const std::map<std::string, std::vector<double>> shown = session_.shown(session_.time_of(step), states);
  const auto last = static_cast<std::int64_t>(series.steps.size()) - 1;
  std::vector<double> frame;
  for (const std::string& field : series.fields) {
    const auto found = shown.find(field);
    const std::vector<double> values = found != shown.end() ? found->second : this->states(series, field, last, 1);
    frame.insert(frame.end(), values.begin(), values.end());
  }
  for (Entry& entry : entries_) {
    if (entry.series == index && entry.instant == static_cast<int>(last)) entry.instant = -1;
  }
  series.places.back() = frames_->count();
  frames_->append(frame);
  entries_.push_back({index, static_cast<int>(last)});
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
  if (frames_ != nullptr && failure_.empty()) append(series, snapshot);
  series.steps.push_back(snapshot.step);
  series.times.push_back(snapshot.t);
  series.observables.push_back(session_.observe(snapshot.t, snapshot.states));
}

/// A disk that is full does not end the run.
void Record::append(Series& series, const Snapshot& snapshot) {
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
  try {
    const std::int64_t place = frames_->count();
    frames_->append(frame);
    series.places.push_back(place);
    entries_.push_back({static_cast<int>(&series - series_.data()), static_cast<int>(series.steps.size())});
  } catch (const Error& error) {
    failure_ = error.what();
  }
}

std::int64_t Record::numbers_of(const Series& series) const {
  return static_cast<std::int64_t>(series.fields.size() * session_.workspace().cell_count());
}

std::vector<double> Record::states(const Series& series, const std::string& field, std::int64_t first,
                                   std::int64_t count) const {
  const std::size_t cells = session_.workspace().cell_count();
  const auto index = std::ranges::find(series.fields, field) - series.fields.begin();
  std::vector<double> all(static_cast<std::size_t>(count) * cells);
  for (std::int64_t k = 0; k < count; ++k) {
    const std::int64_t place = series.places.at(static_cast<std::size_t>(first + k));
    frames_->read(place + index * static_cast<std::int64_t>(cells),
                  std::span(all).subspan(static_cast<std::size_t>(k) * cells, cells));
  }
  return all;
}

std::optional<std::vector<double>> Record::last_state(const std::string& field) const {
  for (const Series& series : series_) {
    const auto instants = static_cast<std::int64_t>(series.places.size());
    if (instants > 0 && failure_.empty() && std::ranges::find(series.fields, field) != series.fields.end())
      return states(series, field, instants - 1, 1);
  }
  return std::nullopt;
}

}  // namespace dpde::tools
