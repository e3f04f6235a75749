// SPDX-License-Identifier: Apache-2.0
// A task as a function of one flat vector of unknowns: initial states and coefficients (interior, x fastest; of a
// control field one interval after the other), then parameters. An unknown parameter also acts through the formulas of
// initial states and coefficients.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dpde/runtime/optimise.h"
#include "driver/scene/session.h"
#include "model/boundary/wall_image.h"

namespace dpde::driver {

class Inverse {
 public:
  struct Part {
    std::string name;
    model::Unknown::Kind kind;
    int index;  // of the state, of an initial one
    Eigen::Index offset, size;
    bool is_field() const { return kind == model::Unknown::Kind::initial || kind == model::Unknown::Kind::coefficient; }
    bool is_control() const { return kind == model::Unknown::Kind::control; }
    bool is_network() const { return kind == model::Unknown::Kind::network; }
    bool is_initial() const { return kind == model::Unknown::Kind::initial; }
    /// Its part of a vector of all unknowns.
    std::vector<double> of(const Eigen::VectorXd& x) const { return {x.data() + offset, x.data() + offset + size}; }
  };

  /// The session's problem has a task. null when `sink` has errors afterwards. The session must outlive the result.
  static std::unique_ptr<Inverse> open(Session& session, const SourceFile& source, DiagnosticSink& sink);

  const std::vector<Part>& parts() const { return parts_; }
  /// The coefficient that the part is, where that is a control field; else null.
  const model::Coefficient* control_field(const Part& part) const;
  /// The scene's own values of a field that is sought.
  const std::vector<double>& own(const Part& part) const { return own_.at(part.name); }
  /// Where the task starts: `from`, or else the scene's own values.
  const Eigen::VectorXd& start() const { return start_; }
  /// Of the unknowns; empty when none has bounds.
  Bounds bounds() const;
  Eigen::Index size() const { return start_.size(); }

  /// Not a number where a solve finds no solution for x, unless the task starts there: then it throws NoSolution.
  double value(const Eigen::VectorXd& x);
  /// `gradient` has size(). Not a number when the session's stop flag was raised, or a condition at a wall is none with
  /// these values.
  double value_and_gradient(const Eigen::VectorXd& x, Eigen::VectorXd& gradient);
  /// The loss, and `gradient` as value_and_gradient() has it, of the state at rest beside which a run until steady
  /// ends; not a number where none is found.
  double value_and_gradient_at_rest(const Eigen::VectorXd& x, Eigen::VectorXd& gradient);
  /// See Engine::hold_steps.
  void hold_steps(bool hold) { session_.engine().hold_steps(hold); }
  /// The condition at a wall that was none with the last values, if there was one.
  const std::optional<model::WallMisfitAt>& misfit() const { return misfit_; }
  /// What had no solution with the last values; "" where all had one.
  const std::string& unsolved() const { return unsolved_; }
  /// Of the last value_and_gradient.
  const GradientResult& last() const { return session_.engine().last_gradient(); }
  /// The rate of the loss at x in a direction, by tangents.
  double rate_along(const Eigen::VectorXd& x, const Eigen::VectorXd& direction);
  /// Whether there are second derivatives; of Gauss and Newton only where each loss is a sum of squares.
  bool has_products(Curvature curvature) const { return session_.engine().why_no_products(curvature).empty(); }
  /// The Hessian at x times v: `result` has size(). Not a number when the session's stop flag was raised.
  void product(const Eigen::VectorXd& x, const Eigen::VectorXd& v, Eigen::VectorXd& result, Curvature curvature);
  /// The task's tests at x, in order; the state's run is repeated once.
  std::vector<std::pair<std::string, double>> tests(const Eigen::VectorXd& x);
  /// Makes the rollout start from x.
  void assign(const Eigen::VectorXd& x);

 private:
  explicit Inverse(Session& session) : session_(session) {}
  std::optional<std::vector<double>> start_of(const Part& part, const SourceFile& source, DiagnosticSink& sink);
  bool make_parts(DiagnosticSink& sink);
  bool make_start(const SourceFile& source, DiagnosticSink& sink);
  bool check_bounds(const Part& part, const std::vector<double>& values, DiagnosticSink& sink) const;
  const model::Unknown& unknown_of(const Part& part) const;
  bool has_walls(const Eigen::VectorXd& x);
  double or_none(const Eigen::VectorXd& x, const std::function<double()>& loss);
  std::map<std::string, std::vector<double>> start_by_formulas();

  Session& session_;
  std::vector<Part> parts_;
  std::map<std::string, std::vector<double>> own_;
  Eigen::VectorXd start_;
  std::optional<model::WallMisfitAt> misfit_;
  std::string unsolved_;
};

}  // namespace dpde::driver
