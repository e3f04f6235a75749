// SPDX-License-Identifier: Apache-2.0
// What a run writes down on its way: observables, and states, which go to a file as they come.
#pragma once

#include <optional>
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
  std::vector<std::vector<std::pair<std::string, double>>> observables;  // at these times
  std::vector<std::int64_t> places = {};  // of the states of these times in the file, all fields each
};

class Record {
 public:
  /// Every `every` steps all states; 0: what the scene says, else the first and the last state of all. States are not
  /// kept where there is no file for them.
  Record(driver::Session& session, int every, FrameFile* frames);

  /// Steps between calls of look() that miss nothing; 0: only the first and the last.
  int interval() const;
  void look(const Snapshot& snapshot);
  /// The state where a run was stopped belongs to the record too.
  void look_at_end(int step, const std::vector<void*>& states);

  /// What is recorded, for a checkpoint; the states are in the file of frames from then on, whatever happens.
  /// @throws Error(machine)
  std::string save();
  /// The same taken over, false when it does not fit.
  /// @throws Error(input) when the states are not there.
  bool restore(std::string_view bytes);
  /// What was recorded of the state where this run goes on is seen by it: a control has another interval there than at
  /// the end of a shorter run.
  void renew(int step, const std::vector<void*>& states);
  /// Fields and intervals, in words.
  std::string plan() const;

  const std::vector<Series>& series() const { return series_; }
  /// Of a field of a series: `count` states from `first`, one after the other. @throws Error(machine)
  std::vector<double> states(const Series& series, const std::string& field, std::int64_t first,
                             std::int64_t count) const;
  /// Of a field that is recorded, where the run ended.
  std::optional<std::vector<double>> last_state(const std::string& field) const;
  /// Why states are missing; "" where none are. The run goes on without them.
  const std::string& failure() const { return failure_; }

 private:
  void drop_former_end(int series);
  bool restore_series(Series& series, driver::ByteReader& in);
  std::int64_t restore_places();
  std::int64_t numbers_of(const Series& series) const;
  void append(Series& series, const Snapshot& snapshot);
  void add(Series& series, const Snapshot& snapshot);
  bool is_shown(const std::string& field) const { return session_.problem().find_shown(field) != nullptr; }
  void renew_shown(int series, int step, const std::vector<void*>& states);

  driver::Session& session_;
  FrameFile* frames_;
  std::vector<Series> series_;
  std::string failure_;

  /// Of which series and instant the states are, in the order of the file.
  struct Entry {
    int series = 0, instant = 0;  // of a former end that was dropped: -1
  };
  std::vector<Entry> entries_;
};

}  // namespace dpde::tools
