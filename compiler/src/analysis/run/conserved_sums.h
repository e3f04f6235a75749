// SPDX-License-Identifier: Apache-2.0
// Which sums a step leaves as they are: integrals of fields and of their squares, and a person's observables, as runs
// of the compiled step from random states on a few cells have them, and steps of the scene itself at some moments;
// those that only the steps in time change; and what becomes of all these in a long run.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "driver/scene/session.h"

namespace dpde::analysis {

struct ConservedSum {
  std::string name;                 // "integral(u)", "integral(u^2)", "integral(u^2 + v^2)", or of the observable
  std::vector<std::string> fields;  // whose integrals it adds up; none: an observable
  bool of_squares = false;
  bool but_for_steps = false;   // the differences keep it, and steps lose the less the shorter they are: energies
  bool until_switched = false;  // there are states from which steps change it, as by a source that states switch on
};
/// nullopt where no run could be made.
std::optional<std::vector<ConservedSum>> conserved_sums(const SourceFile& source,
                                                        const std::shared_ptr<const driver::Compiled>& compiled);

/// What rounding may make of a sum in so many steps, relative to the integral of magnitudes: one unit of it a step, and
/// what adding up costs.
double rounding_of_sums(Precision real, int steps);

/// Of a sum over a run.
struct SumDrift {
  std::string name;
  double begin = 0, end = 0;
  double per_time = 0;  // (end - begin)/time
  double largest = 0;   // distance from the first value at the times that were looked at, over the magnitude
  bool but_for_steps = false, until_switched = false;
  bool exceeds_rounding = false;
};
class SumMonitor {
 public:
  SumMonitor(driver::Session& session, std::vector<ConservedSum> sums);

  /// A state of the run, in the order of the session's rollout. It takes one pass over the fields, in place.
  void look(int step, double t, const std::vector<void*>& states);
  std::vector<SumDrift> drifts() const;

 private:
  struct Value {
    double sum = 0, magnitude = 0;
  };
  Value integral(const void* state, const std::string& field, bool of_square) const;
  double size_beside(const std::vector<void*>& states, const std::string& field, bool of_square) const;
  /// Of each observable its value for the magnitudes of all states: that of an integral that is 0 is not.
  std::vector<std::pair<std::string, double>> sizes(double t, const std::vector<void*>& states) const;

  driver::Session& session_;
  std::vector<ConservedSum> sums_;
  std::vector<std::vector<Value>> values_;  // of each sum, one a look
  std::vector<double> times_;
  std::vector<std::pair<std::string, double>> sizes_;  // at the first look
  int first_ = 0, last_ = 0;                           // steps
};

}  // namespace dpde::analysis
