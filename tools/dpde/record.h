// SPDX-License-Identifier: Apache-2.0
// What a run of a session writes down on its way.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dpde/runtime/run_record.h"
#include "driver/scene/session.h"

namespace dpde::tools {

class Record {
 public:
  /// Every `every` steps all states; 0: what the scene says, else the first and the last state of all. States are not
  /// kept where there is no file for them.
  Record(driver::Session& session, int every, FrameFile* frames);

  const RunRecord& kept() const { return record_; }
  /// Records the state where it is due; look() is called at whole intervals of the record at least.
  void look(const Snapshot& snapshot);
  /// The state where a run was stopped belongs to the record too.
  void look_at_end(int step, const std::vector<void*>& states);

  std::string save() { return record_.save(); }
  /// What save() gave, taken over, without the last state of a shorter run. False when it does not fit.
  /// @throws Error(input) when the states are not there.
  bool restore(std::string_view bytes);
  /// What was recorded of the state where this run goes on is seen by it: a control has another interval there than at
  /// the end of a shorter run.
  void renew(int step, const std::vector<void*>& states);

 private:
  void drop_former_end(std::size_t series);
  void add(std::size_t series, const Snapshot& snapshot);
  std::vector<double> frame_of(const Series& series, const Snapshot& snapshot);
  bool is_shown(const std::string& field) const { return session_.problem().find_shown(field) != nullptr; }

  driver::Session& session_;
  RunRecord record_;
};

}  // namespace dpde::tools
