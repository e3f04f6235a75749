// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/run_record.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>

#include "dpde/runtime/error.h"

namespace dpde {

std::vector<Series> record_plan(const std::vector<std::string>& states, int every, std::vector<Series> outputs) {
  if (every > 0 || outputs.empty()) return {{states, every}};
  return outputs;
}

RunRecord::RunRecord(std::vector<Series> plan, std::vector<std::string> observables, std::size_t cells,
                     FrameFile* frames)
    : series_(std::move(plan)), observables_(std::move(observables)), cells_(cells), frames_(frames) {}

int RunRecord::interval() const {
  int interval = 0;
  for (const Series& series : series_) interval = std::gcd(interval, series.every);
  return interval;
}

std::string RunRecord::plan() const {
  std::string plan;
  for (const Series& series : series_) {
    plan += fmt::format("{}{} every {} steps", plan.empty() ? "" : "; ", fmt::join(series.fields, ", "), series.every);
  }
  return plan;
}

bool RunRecord::is_due(std::size_t index, int step, bool is_last) const {
  const Series& series = series_[index];
  if (!series.steps.empty() && series.steps.back() >= step) return false;  // recorded before a restart
  return step == 0 || is_last || (series.every > 0 && step % series.every == 0);
}

/// A full disk does not end the run: its states are then missing.
void RunRecord::keep(std::size_t index, std::size_t instant, std::span<const double> frame) {
  std::vector<std::int64_t>& places = series_[index].places;
  try {
    const std::int64_t place = frames_->count();
    frames_->append(frame);
    places.resize(instant);
    places.push_back(place);
    entries_.push_back({static_cast<int>(index), static_cast<int>(instant)});
  } catch (const Error& error) {
    failure_ = error.what();
  }
}

void RunRecord::add(std::size_t index, int step, double t, Observed observables, std::span<const double> frame) {
  Series& series = series_[index];
  if (keeps_states()) keep(index, series.steps.size(), frame);
  series.steps.push_back(step);
  series.times.push_back(t);
  series.observables.push_back(std::move(observables));
}

void RunRecord::forget(std::size_t index, std::size_t instant) {
  for (Entry& entry : entries_) {
    if (entry.series == static_cast<int>(index) && entry.instant == static_cast<int>(instant)) entry.instant = -1;
  }
}

void RunRecord::renew(std::size_t index, Observed observables, std::span<const double> frame) {
  Series& series = series_[index];
  series.observables.back() = std::move(observables);
  if (frame.empty()) return;
  const std::size_t last = series.steps.size() - 1;
  forget(index, last);
  keep(index, last, frame);
}

void RunRecord::drop_last(std::size_t index) {
  Series& series = series_[index];
  series.steps.pop_back();
  series.times.pop_back();
  series.observables.pop_back();
  series.places.resize(std::min(series.places.size(), series.steps.size()));  // states may be missing
  forget(index, series.steps.size());
}

std::string RunRecord::save() {
  if (!failure_.empty()) throw Error(ErrorKind::machine, failure_);
  const FrameMark mark = frames_->sync();
  ByteWriter out;
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
    for (const Observed& row : series.observables) {
      for (const auto& [name, value] : row) out.values({value});
    }
  }
  return out.bytes();
}

bool RunRecord::restore(std::string_view bytes) {
  ByteReader in(bytes);
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
  return is_whole && std::ranges::all_of(series_, [](const Series& s) { return s.places.size() == s.steps.size(); });
}

bool RunRecord::restore_series(Series& series, ByteReader& in) const {
  const std::vector<double> steps = in.values();
  series.steps.assign(steps.begin(), steps.end());
  series.times = in.values();
  if (series.times.size() != steps.size()) return false;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    Observed& row = series.observables.emplace_back();
    for (const std::string& name : observables_) {
      const std::vector<double> value = in.values();
      if (value.size() != 1) return false;
      row.emplace_back(name, value[0]);
    }
  }
  return true;
}

/// Assigns positions in the order of the entries, each with all fields of its series; entries of dropped instants are
/// skipped. Returns the total count of numbers.
std::int64_t RunRecord::restore_places() {
  std::int64_t place = 0;
  for (const Entry& entry : entries_) {
    Series& series = series_[static_cast<std::size_t>(entry.series)];
    if (entry.instant == static_cast<int>(series.places.size())) series.places.push_back(place);
    place += numbers_of(series);
  }
  return place;
}

std::vector<double> RunRecord::states(const Series& series, const std::string& field, std::int64_t first,
                                      std::int64_t count) const {
  const auto index = std::ranges::find(series.fields, field) - series.fields.begin();
  std::vector<double> all(static_cast<std::size_t>(count) * cells_);
  for (std::int64_t k = 0; k < count; ++k) {
    const std::int64_t place = series.places.at(static_cast<std::size_t>(first + k));
    frames_->read(place + index * static_cast<std::int64_t>(cells_),
                  std::span(all).subspan(static_cast<std::size_t>(k) * cells_, cells_));
  }
  return all;
}

std::optional<std::vector<double>> RunRecord::last_state(const std::string& field) const {
  for (const Series& series : series_) {
    const auto instants = static_cast<std::int64_t>(series.places.size());
    if (instants > 0 && failure_.empty() && std::ranges::find(series.fields, field) != series.fields.end())
      return states(series, field, instants - 1, 1);
  }
  return std::nullopt;
}

}  // namespace dpde
