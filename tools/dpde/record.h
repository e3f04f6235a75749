// SPDX-License-Identifier: Apache-2.0
// Records a run of a session.
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
  /// All states every `every` steps; 0: the outputs of the scene, else the first and the last state of all fields.
  /// Without a file for frames states are not stored.
  Record(driver::Session& session, int every, FrameFile* frames);

  const RunRecord& kept() const { return record_; }
  /// Records the state if it is due. Must be called at least at all multiples of the record's interval.
  void look(const Snapshot& snapshot);
  /// Records the state at which a run was stopped.
  void look_at_end(int step, const std::vector<void*>& states);

  std::string save() { return record_.save(); }
  /// Restores the result of save(), without the last state of a shorter run. Returns false if it does not fit.
  /// @throws Error(input) if the states are missing.
  bool restore(std::string_view bytes);
  /// Recomputes the recorded values of the state where this run resumes: a control has another interval there than at
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
