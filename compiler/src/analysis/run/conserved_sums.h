// SPDX-License-Identifier: Apache-2.0
// Finds conserved sums: integrals of fields and of their squares, and observables. Tests runs of the compiled step from
// random states on a few cells, and steps of the scene at some times. Also finds sums changed only by time
// discretisation, and measures the drift of all in a long run.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "driver/scene/session.h"

namespace dpde::analysis {

struct ConservedSum {
  std::string name;                 // "integral(u)", "integral(u^2)", "integral(u^2 + v^2)", or the observable's name
  std::vector<std::string> fields;  // integrated fields; empty: an observable
  bool of_squares = false;
  bool but_for_steps = false;   // conserved in space; the loss falls with the time step, as for energies
  bool until_switched = false;  // some states lead to steps that change it, e.g. by a source they switch on
};
/// nullopt if no run is possible.
std::optional<std::vector<ConservedSum>> conserved_sums(const SourceFile& source,
                                                        const std::shared_ptr<const driver::Compiled>& compiled);

/// Bound of a sum's relative rounding after `steps` steps: one unit rounding for each step, and that of the summation.
double rounding_of_sums(Precision real, int steps);

/// Drift of a sum over a run.
struct SumDrift {
  std::string name;
  double begin = 0, end = 0;
  double per_time = 0;  // (end - begin)/time
  double largest = 0;   // distance from the first value at the sampled times, relative to the magnitude
  bool but_for_steps = false, until_switched = false;
  bool exceeds_rounding = false;
};
class SumMonitor {
 public:
  SumMonitor(driver::Session& session, std::vector<ConservedSum> sums);

  /// Samples a state of the run, in the order of the session's rollout. One pass over the fields, without copies.
  void look(int step, double t, const std::vector<void*>& states);
  std::vector<SumDrift> drifts() const;

 private:
  struct Value {
    double sum = 0, magnitude = 0;
  };
  Value integral(const void* state, const std::string& field, bool of_square) const;
  double size_beside(const std::vector<void*>& states, const std::string& field, bool of_square) const;
  /// Value of each observable for the magnitudes of all states; nonzero even if the integral is 0.
  std::vector<std::pair<std::string, double>> sizes(double t, const std::vector<void*>& states) const;

  driver::Session& session_;
  std::vector<ConservedSum> sums_;
  std::vector<std::vector<Value>> values_;  // for each sum, one for each sample
  std::vector<double> times_;
  std::vector<std::pair<std::string, double>> sizes_;  // at the first sample
  int first_ = 0, last_ = 0;                           // steps
};

}  // namespace dpde::analysis
