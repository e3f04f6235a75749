// SPDX-License-Identifier: Apache-2.0
// Growth of disturbances in steps of a scene, by runs of the compiled step alone. No code of the stability analysis is
// used.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "driver/scene/session.h"

namespace dpde::testing {

/// All columns of the derivative G of one step about a state, by central differences of runs of that step from states
/// that differ in one value. Its eigenvalues give the growth of small disturbances after many steps. By the definition
/// of the manual (accuracy.md) a step of length dt is unstable if one of these holds. g is ln of the largest
/// |eigenvalue|, e that of a step of length 0, and r the growth rate of short steps:
///   - g(dt) > e + 2 max(0, r) dt;
///   - where r is positive, more eigenvalues grow than rates of short steps do not decay;
///   - one of the first 512 powers is a hundred times as large as steps of an eighth make it in the same time, both
///     beyond what is allowed to grow.
/// States that depend on one another form a group. Each group is judged by its own rates, from a submatrix of G. Errors
/// of differences and rounding are estimated, so an answer may be "unclear".
class StepsByRuns {
 public:
  /// `step`: the order of magnitude of the tried steps; rates come from fractions of it. `without_events`: the same
  /// scene without events, which gives the rates of the equations; null: the scene has no events.
  StepsByRuns(driver::Session& session, double step, const StepsByRuns* without_events = nullptr);

  enum class Answer { stable, unclear, grows };
  /// At some times of the run.
  Answer answer(double step) const;
  /// ln of the largest |eigenvalue| minus the allowed growth.
  double excess(double step) const;
  bool is_finite() const { return is_finite_; }
  /// "24 values, rate 0.1"
  std::string text() const;

  /// The matrix of a step about the state at which steps begin.
  Eigen::MatrixXd tangent(double step, double time) const;

 private:
  struct Place {
    std::size_t state, cell;
  };
  struct Range {
    double low = 0, high = 0;
    double width() const { return high - low; }
  };
  /// States that depend on one another, and their rates.
  struct Group {
    std::vector<std::size_t> states;
    Range rate;            // 1/time
    double by_events = 0;  // ln a step
    Eigen::Index lasting = 0;
  };
  using States = std::vector<std::vector<double>>;
  Eigen::Index size() const { return static_cast<Eigen::Index>(places_.size()); }
  States after(Rollout& run, const States& states) const;
  void find_groups(double step);
  Eigen::MatrixXd part_of(const Eigen::MatrixXd& tangent, const Group& group) const;
  bool may_be_of_equations(std::complex<double> eigenvalue) const;
  Eigen::Index count_lasting(const Eigen::MatrixXd& part, double parts) const;
  Range growth(const Eigen::MatrixXd& part, bool of_equations) const;
  void measure(Group& group, double step, double time) const;
  Range rate_at(Group& group, double step, double time) const;
  Answer answer(const Group& group, const Eigen::MatrixXd& tangent, double step, double time) const;
  /// The largest norm of the first powers, divided by the allowed one.
  double on_the_way(const Group& group, const Eigen::MatrixXd& part, double step, double time) const;

  driver::Session& session_;
  bool remembers_ = false;
  States begin_;
  std::vector<double> scales_;  // of states
  std::vector<Place> places_;
  std::vector<double> times_;
  std::vector<Group> groups_;
  bool is_finite_ = true;
};

}  // namespace dpde::testing
