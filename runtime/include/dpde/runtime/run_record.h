// SPDX-License-Identifier: Apache-2.0
// What a run writes down on its way: observables, and states, which go to a file as they come. Whoever runs it computes
// both; files are made of it in the end (run_file.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "dpde/runtime/bytes.h"
#include "dpde/runtime/frame_file.h"

namespace dpde {

/// Values by name.
using Observed = std::vector<std::pair<std::string, double>>;

/// States at equal intervals of steps, and the first and the last one in any case.
struct Series {
  std::vector<std::string> fields;
  int every = 0;  // 0: only the first and the last
  std::vector<int> steps = {};
  std::vector<double> times = {};
  std::vector<Observed> observables = {};  // at these times
  std::vector<std::int64_t> places = {};   // of the states of these times in the file, all fields each
};

/// Every `every` steps all states; 0: the outputs that a scene names, else the first and the last state of all.
std::vector<Series> record_plan(const std::vector<std::string>& states, int every, std::vector<Series> outputs);

class RunRecord {
 public:
  /// `cells`: values of a field. States are not kept where there is no file for them.
  RunRecord(std::vector<Series> plan, std::vector<std::string> observables, std::size_t cells, FrameFile* frames);

  /// Fields and intervals, in words.
  std::string plan() const;
  /// Steps between instants of any series; 0: only the first and the last.
  int interval() const;
  /// Whether the series holds the state of this step, and does not have it yet.
  bool is_due(std::size_t series, int step, bool is_last) const;
  /// States are missing where there is no file for them, or where that could not be written.
  bool keeps_states() const { return frames_ != nullptr && failure_.empty(); }
  /// An instant behind those that there are. `frame`: where states are kept, those of its fields one after the other.
  void add(std::size_t series, int step, double t, Observed observables, std::span<const double> frame);
  /// In place of those of the last instant, with a `frame` the states too.
  void renew(std::size_t series, Observed observables, std::span<const double> frame);
  void drop_last(std::size_t series);

  const std::vector<Series>& series() const { return series_; }
  /// Of a field of a series: `count` states from `first`, one after the other. @throws Error(machine)
  std::vector<double> states(const Series& series, const std::string& field, std::int64_t first,
                             std::int64_t count) const;
  /// Of a field that is recorded, where the run ended.
  std::optional<std::vector<double>> last_state(const std::string& field) const;
  /// Why states are missing; "" where none are. The run goes on without them.
  const std::string& failure() const { return failure_; }

  /// For a checkpoint; the states are in the file of frames from then on, whatever happens. @throws Error(machine)
  std::string save();
  /// The same taken over, false when it does not fit. @throws Error(input) when the states are not there.
  bool restore(std::string_view bytes);

 private:
  bool restore_series(Series& series, ByteReader& in) const;
  std::int64_t restore_places();
  std::int64_t numbers_of(const Series& series) const {
    return static_cast<std::int64_t>(series.fields.size() * cells_);
  }
  void keep(std::size_t series, std::size_t instant, std::span<const double> frame);
  void forget(std::size_t series, std::size_t instant);

  std::vector<Series> series_;
  std::vector<std::string> observables_;
  std::size_t cells_;
  FrameFile* frames_;
  std::string failure_;

  /// Of which series and instant the states are, in the order of the file.
  struct Entry {
    int series = 0, instant = 0;  // of one that was dropped: -1
  };
  std::vector<Entry> entries_;
};

}  // namespace dpde
