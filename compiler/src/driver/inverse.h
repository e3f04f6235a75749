// SPDX-License-Identifier: Apache-2.0
// A task as a function of one flat vector of unknowns: initial states (interior, x fastest), then parameters. An unknown
// parameter also acts through the formulas of the initial states.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "driver/session.h"

namespace dpde::driver {

class Inverse {
 public:
  struct Part {
    std::string name;
    bool initial;  // an initial state, otherwise a parameter
    int index;     // of the state or of the rollout's parameter gradient (-1: none)
    Eigen::Index offset, size;
  };

  /// The session's problem has a task. null when `sink` has errors afterwards. The session must outlive the result.
  static std::unique_ptr<Inverse> open(Session& session, const SourceFile& source, DiagnosticSink& sink);

  const std::vector<Part>& parts() const { return parts_; }
  /// Where the task starts: `from`, or else the scene's own values.
  const Eigen::VectorXd& start() const { return start_; }
  Eigen::Index size() const { return start_.size(); }

  double value(const Eigen::VectorXd& x);
  /// `gradient` has size(). Not a number when the session's stop flag was raised.
  double value_and_gradient(const Eigen::VectorXd& x, Eigen::VectorXd& gradient);
  /// Of the last value_and_gradient.
  const GradientResult& last() const { return *last_; }
  /// The task's tests at x, in order; the state's run is repeated once.
  std::vector<std::pair<std::string, double>> tests(const Eigen::VectorXd& x);
  /// Makes the rollout start from x.
  void assign(const Eigen::VectorXd& x);

 private:
  explicit Inverse(Session& session) : session_(session) {}
  bool make_parts(DiagnosticSink& sink);
  bool make_start(const SourceFile& source, DiagnosticSink& sink);
  void add_gradient_through_initial(Eigen::VectorXd& gradient);

  Session& session_;
  std::vector<Part> parts_;
  Eigen::VectorXd start_;
  bool initial_depends_ = false;  // a formula of an initial state holds an unknown parameter
  const GradientResult* last_ = nullptr;
};

}  // namespace dpde::driver
