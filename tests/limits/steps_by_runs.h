// SPDX-License-Identifier: Apache-2.0
// What steps of a scene do to disturbances, by runs of the compiled step alone: no tangent, no wave and nothing else of
// the analysis of stability.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "driver/scene/session.h"

namespace dpde::testing {

/// All columns of the derivative G of one step about a state, by central differences of runs of that step from states
/// that differ in one value. A run of the difference of two runs that is made small again after each step is a product
/// of such matrices: what it comes to, after however many steps, are their eigenvalues. By the definition of the manual
/// (accuracy.md) a step of length dt is unstable where one of these holds, g being ln of the largest |eigenvalue|, e
/// that of a step of no length and r the rate of growth of short steps:
///   - g(dt) > e + 2 max(0, r) dt;
///   - where r is positive, more eigenvalues grow than rates of short steps do not decay;
///   - one of the first 512 powers is a hundred times as large as steps of an eighth make it in the same time, both
///     beyond what is allowed to grow.
/// States that act on one another are a group, and each group is judged by its own rates: by parts of G.
/// Errors of differences and rounding are known, so that an answer may be that nobody can tell.
class StepsByRuns {
 public:
  /// `step`: of the size of steps that are asked about; rates are those of parts of it. `without_events`: of the same
  /// scene; whatever events damp, its rates are those of the equations. Null: the scene has none.
  StepsByRuns(driver::Session& session, double step, const StepsByRuns* without_events = nullptr);

  enum class Answer { stable, unclear, grows };
  /// At some times of the run.
  Answer answer(double step) const;
  /// ln of the largest |eigenvalue| less what is allowed.
  double excess(double step) const;
  bool is_finite() const { return is_finite_; }
  /// "24 values, rate 0.1"
  std::string text() const;

  /// Of a step about the state with which steps begin.
  Eigen::MatrixXd tangent(double step, double time) const;

 private:
  struct Place {
    std::size_t state, cell;
  };
  struct Range {
    double low = 0, high = 0;
    double width() const { return high - low; }
  };
  /// States that act on one another, and what is theirs.
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
  /// The largest of the first powers, over what is too large.
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
