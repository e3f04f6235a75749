// SPDX-License-Identifier: Apache-2.0
// What a run writes down on its way: states and observables.
#pragma once

#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "driver/restart_file.h"
#include "driver/session.h"
#include "frame_file.h"

namespace dpde::tools {

/// States at equal intervals of steps, and the first and the last one in any case.
struct Series {
  std::vector<std::string> fields;
  int every = 0;  // 0: only the first and the last
  std::vector<int> steps;
  std::vector<double> times;
  std::map<std::string, std::vector<double>> values;                     // one state after the other
  std::vector<std::vector<std::pair<std::string, double>>> observables;  // at these times
};

class Record {
 public:
  /// Every `every` steps all states; 0: what the scene says, else the first and the last state of all.
  Record(driver::Session& session, int every, bool keeps_states);

  /// Steps between calls of look() that miss nothing; 0: only the first and the last.
  int interval() const;
  void look(const Snapshot& snapshot);
  /// The state where a run was stopped belongs to the record too.
  void look_at_end(int step, const std::vector<void*>& states);

  /// What is recorded, for a checkpoint: states that are new go behind the others in `frames`, the rest is what comes
  /// back.
  /// @throws Error(machine)
  std::string save(FrameFile& frames);
  /// The same taken over, false when it does not fit.
  /// @throws Error(input) when the states are not there.
  bool restore(std::string_view bytes, FrameFile& frames);
  /// What was recorded of the state where this run goes on is seen by it: a control has another interval there than at
  /// the end of a shorter run.
  void renew(int step, const std::vector<void*>& states);
  /// Fields and intervals, in words.
  std::string plan() const;

  const std::vector<Series>& series() const { return series_; }
  /// At the end, when nothing is recorded any more.
  std::vector<Series> take_series() { return std::exchange(series_, {}); }

 private:
  void drop_former_end(int series);
  bool restore_series(Series& series, driver::ByteReader& in);
  bool restore_states(std::span<const double> states);
  void add(Series& series, const Snapshot& snapshot);
  bool is_shown(const std::string& field) const { return session_.problem().find_shown(field) != nullptr; }
  void renew_shown(int series, int step, const std::vector<void*>& states);

  driver::Session& session_;
  bool keeps_states_;
  std::vector<Series> series_;

  /// Where the states of an instant stand in `series_`, in the order they were recorded.
  struct Entry {
    int series = 0, instant = 0;  // of a former end that was dropped: -1
  };
  std::vector<Entry> entries_;
  std::size_t saved_ = 0;  // of these in the file
};

}  // namespace dpde::tools
