// SPDX-License-Identifier: Apache-2.0
// Detects inflow through an open end, where no condition says what flows in.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "driver/scene/session.h"

namespace dpde::driver {

/// Checks velocities bound by a constraint, on sides that are outflow. Keeps the worst of the sampled times.
class BackFlowWatch {
 public:
  explicit BackFlowWatch(Session& session) : session_(&session) {}

  void look(double t, const std::vector<void*>& states);
  /// Reports nothing if the inflow never exceeded a thousandth of the field's largest speed.
  void report(DiagnosticSink& sink) const;

 private:
  struct Worst {
    double t = 0, inwards = 0, largest = 0;  // largest: over the whole field
    std::int64_t faces = 0, of = 0;
    double share() const { return largest > 0 ? inwards / largest : 0; }
  };
  void look_at(const model::State& state, std::size_t axis, double t, const void* values);

  Session* session_;
  std::map<std::pair<std::string, std::size_t>, Worst> worst_;  // by state and axis
};

}  // namespace dpde::driver
