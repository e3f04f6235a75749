// SPDX-License-Identifier: Apache-2.0
// Flow that comes in through an open end: nothing says what it brings.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "driver/scene/session.h"

namespace dpde::driver {

/// Of the velocity that a constraint binds, on the sides where it is outflow; the worst of the moments looked at.
class BackFlowWatch {
 public:
  explicit BackFlowWatch(Session& session) : session_(&session) {}

  void look(double t, const std::vector<void*>& states);
  /// Nothing where no moment had more than a thousandth of the largest speed of that field coming in.
  void report(DiagnosticSink& sink) const;

 private:
  struct Worst {
    double t = 0, inwards = 0, largest = 0;  // largest: of the field, at any place
    std::int64_t faces = 0, of = 0;
    double share() const { return largest > 0 ? inwards / largest : 0; }
  };
  void look_at(const model::State& state, std::size_t axis, double t, const void* values);

  Session* session_;
  std::map<std::pair<std::string, std::size_t>, Worst> worst_;  // by state and axis
};

}  // namespace dpde::driver
