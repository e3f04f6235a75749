// SPDX-License-Identifier: Apache-2.0
// A task as a function of one flat vector of unknowns: initial states and coefficients (interior, x fastest; control
// fields interval after interval), then parameters. An unknown parameter also acts through the formulas of initial
// states and coefficients.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dpde/runtime/optimise.h"
#include "driver/scene/ghost_counts.h"
#include "driver/scene/session.h"
#include "model/boundary/wall_image.h"

namespace dpde::driver {

class Inverse {
 public:
  struct Part {
    std::string name;
    model::Unknown::Kind kind;
    int index;  // of the state, for an initial state
    Eigen::Index offset, size;
    bool is_field() const { return kind == model::Unknown::Kind::initial || kind == model::Unknown::Kind::coefficient; }
    bool is_control() const { return kind == model::Unknown::Kind::control; }
    bool is_network() const { return kind == model::Unknown::Kind::network; }
    bool is_initial() const { return kind == model::Unknown::Kind::initial; }
    /// Its part of a vector of all unknowns.
    std::vector<double> of(const Eigen::VectorXd& x) const { return {x.data() + offset, x.data() + offset + size}; }
  };

  /// Requires a task in the session. Returns null if `sink` has errors afterwards. The session must outlive the result.
  static std::unique_ptr<Inverse> open(Session& session, const SourceFile& source, DiagnosticSink& sink);

  const std::vector<Part>& parts() const { return parts_; }
  /// The coefficient of the part if it is a control field; else null.
  const model::Coefficient* control_field(const Part& part) const;
  /// The scene's values of an unknown field.
  const std::vector<double>& own(const Part& part) const { return own_.at(part.name); }
  /// Start of the task: `from`, or else the scene's values.
  const Eigen::VectorXd& start() const { return start_; }
  /// Bounds of the unknowns; empty if there are none.
  Bounds bounds() const;
  Eigen::Index size() const { return start_.size(); }

  /// The loss at x. NaN if a solve has no solution there; at the task's start it throws NoSolution instead.
  double value(const Eigen::VectorXd& x);
  /// Also sets `gradient`, which must have size(). NaN also if the session's stop flag was raised, or if a boundary
  /// condition is not well-defined for x.
  double value_and_gradient(const Eigen::VectorXd& x, Eigen::VectorXd& gradient);
  /// Loss and gradient, as above, at the steady state near the end of a run until steady; NaN if none is found.
  double value_and_gradient_at_rest(const Eigen::VectorXd& x, Eigen::VectorXd& gradient);
  /// See Engine::hold_steps.
  void hold_steps(bool hold) { session_.engine().hold_steps(hold); }
  /// The boundary condition that was not well-defined for the last x, if there was one.
  const std::optional<model::WallMisfitAt>& misfit() const { return misfit_; }
  /// The equation without a solution for the last x; "" if all had one.
  const std::string& unsolved() const { return unsolved_; }
  /// Result of the last value_and_gradient.
  const GradientResult& last() const { return session_.engine().last_gradient(); }
  /// Directional derivative of the loss at x, by tangents.
  double rate_along(const Eigen::VectorXd& x, const Eigen::VectorXd& direction);
  /// Whether Hessian products exist; for Gauss-Newton only if each loss is a sum of squares.
  bool has_products(Curvature curvature) const { return session_.engine().why_no_products(curvature).empty(); }
  /// The Hessian at x times v; `result` must have size(). NaN if the session's stop flag was raised.
  void product(const Eigen::VectorXd& x, const Eigen::VectorXd& v, Eigen::VectorXd& result, Curvature curvature);
  /// Values of the task's tests at x, in order; runs the scene once.
  std::vector<std::pair<std::string, double>> tests(const Eigen::VectorXd& x);
  /// Sets the start of the rollout to x.
  void assign(const Eigen::VectorXd& x);

 private:
  explicit Inverse(Session& session) : session_(session), ghosts_(ghost_counts(session.compiled())) {}
  std::optional<std::vector<double>> start_of(const Part& part, const SourceFile& source, DiagnosticSink& sink);
  bool make_parts(DiagnosticSink& sink);
  bool make_start(const SourceFile& source, DiagnosticSink& sink);
  bool check_bounds(const Part& part, const std::vector<double>& values, DiagnosticSink& sink) const;
  const model::Unknown& unknown_of(const Part& part) const;
  bool has_walls(const Eigen::VectorXd& x);
  double or_none(const Eigen::VectorXd& x, const std::function<double()>& loss);
  std::map<std::string, std::vector<double>> start_by_formulas();

  Session& session_;
  const model::GhostCounts ghosts_;
  std::vector<Part> parts_;
  std::map<std::string, std::vector<double>> own_;
  Eigen::VectorXd start_;
  std::optional<model::WallMisfitAt> misfit_;
  std::string unsolved_;
};

}  // namespace dpde::driver
