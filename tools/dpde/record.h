// SPDX-License-Identifier: Apache-2.0
// What a run writes down on its way: states and observables.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "driver/session.h"

namespace dpde::tools {

/// States at equal intervals of steps, and the first and the last one in any case.
struct Series {
  std::vector<std::string> fields;
  int every = 0;  // 0: only the first and the last
  std::vector<int> steps;
  std::vector<double> times;
  std::map<std::string, std::vector<double>> values;                        // one state after the other
  std::vector<std::vector<std::pair<std::string, double>>> observables;     // at these times
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

  /// What is recorded, for a checkpoint; and the same taken over, false when it does not fit.
  std::string bytes() const;
  bool restore(std::string_view bytes);
  /// Fields and intervals, in words.
  std::string plan() const;

  const std::vector<Series>& series() const { return series_; }

 private:
  void drop_former_end(Series& series) const;
  void add(Series& series, const Snapshot& snapshot);

  driver::Session& session_;
  bool keeps_states_;
  std::vector<Series> series_;
};

}  // namespace dpde::tools
