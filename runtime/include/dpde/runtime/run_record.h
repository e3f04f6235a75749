// SPDX-License-Identifier: Apache-2.0
// The record of a run: observables, and states, which go to a file as they come. The caller computes both; the output
// files are written at the end (run_file.h).
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

/// States at equal intervals of steps, and always the first and the last one.
struct Series {
  std::vector<std::string> fields;
  int every = 0;  // 0: only the first and the last
  std::vector<int> steps = {};
  std::vector<double> times = {};
  std::vector<Observed> observables = {};  // at these times
  std::vector<std::int64_t> places = {};   // index in the file of the states of these times, all fields each
};

/// All states every `every` steps; 0: the outputs that the scene names, else the first and the last state of all
/// fields.
std::vector<Series> record_plan(const std::vector<std::string>& states, int every, std::vector<Series> outputs);

class RunRecord {
 public:
  /// `cells`: values of a field. Without a file for frames states are not stored.
  RunRecord(std::vector<Series> plan, std::vector<std::string> observables, std::size_t cells, FrameFile* frames);

  /// Fields and intervals, as text.
  std::string plan() const;
  /// Steps between instants of any series; 0: only the first and the last.
  int interval() const;
  /// Whether the series records the state of this step, and does not have it yet.
  bool is_due(std::size_t series, int step, bool is_last) const;
  /// False if there is no file for states, or if it could not be written.
  bool keeps_states() const { return frames_ != nullptr && failure_.empty(); }
  /// Appends an instant. `frame`: if states are stored, the fields of the series one after the other.
  void add(std::size_t series, int step, double t, Observed observables, std::span<const double> frame);
  /// Replaces observables, and with a `frame` the states, of the last instant.
  void renew(std::size_t series, Observed observables, std::span<const double> frame);
  void drop_last(std::size_t series);

  const std::vector<Series>& series() const { return series_; }
  /// `count` states of a field of a series, from number `first` on, one after the other. @throws Error(machine)
  std::vector<double> states(const Series& series, const std::string& field, std::int64_t first,
                             std::int64_t count) const;
  /// The state of a recorded field at the end of the run.
  std::optional<std::vector<double>> last_state(const std::string& field) const;
  /// Why states are missing; "": none are. The run continues without them.
  const std::string& failure() const { return failure_; }

  /// For a checkpoint; the states are then safely in the file of frames. @throws Error(machine)
  std::string save();
  /// Restores that; false if it does not fit. @throws Error(input) if the states are missing.
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

  /// Series and instant of each entry of the file, in its order.
  struct Entry {
    int series = 0, instant = 0;  // instant -1: dropped
  };
  std::vector<Entry> entries_;
};

}  // namespace dpde
