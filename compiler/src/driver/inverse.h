// SPDX-License-Identifier: Apache-2.0
// A task as a function of one flat vector of unknowns: initial states and coefficients (interior, x fastest; of a
// control field one interval after the other), then parameters. An unknown parameter also acts through the formulas of
// initial states and coefficients.
#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "dpde/runtime/optimise.h"
#include "driver/session.h"
#include "model/wall_image.h"

namespace dpde::driver {

/// The order of the unknowns in the vector; within a kind that of the task.
inline constexpr model::Unknown::Kind unknown_kinds[] = {
    model::Unknown::Kind::initial, model::Unknown::Kind::coefficient, model::Unknown::Kind::parameter,
    model::Unknown::Kind::control, model::Unknown::Kind::network};

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

  double value(const Eigen::VectorXd& x);
  /// `gradient` has size(). Not a number when the session's stop flag was raised, or a condition at a wall is none with
  /// these values.
  double value_and_gradient(const Eigen::VectorXd& x, Eigen::VectorXd& gradient);
  /// The condition at a wall that was none with the last values, if there was one.
  const std::optional<model::WallMisfit>& misfit() const { return misfit_; }
  /// Of the last value_and_gradient.
  const GradientResult& last() const { return *last_; }
  /// The task's tests at x, in order; the state's run is repeated once.
  std::vector<std::pair<std::string, double>> tests(const Eigen::VectorXd& x);
  /// The part's values of x for the parameter or control called `name`, that of the part or its rate.
  void set_values(const std::string& name, const Part& part, const Eigen::VectorXd& x);
  /// Makes the rollout start from x.
  void assign(const Eigen::VectorXd& x);

  /// What the last gradient of `rollout` says of the unknowns, or of their rates.
  void copy_bars(const Rollout& rollout, bool of_rates, Eigen::VectorXd& to) const;
  /// What unknown parameters add to that through the fields of a formula; `adjoint` is the adjoint of its program, or
  /// of its tangent. Of rates only what comes by rates: Gauss-Newton leaves out the formulas' own second derivatives,
  /// too.
  void add_through_formula(const Rollout& rollout, const dpde_program& adjoint, bool of_rates, Eigen::VectorXd& to);

 private:
  explicit Inverse(Session& session) : session_(session) {}
  bool make_parts(DiagnosticSink& sink);
  bool make_start(const SourceFile& source, DiagnosticSink& sink);
  bool check_bounds(const Part& part, const std::vector<double>& values, DiagnosticSink& sink) const;
  const model::Unknown& unknown_of(const Part& part) const;
  std::string rate_of(const Part& part) const;
  std::set<std::string, std::less<>> rates_of_fields() const;
  bool has_walls(const Eigen::VectorXd& x);
  bool reads_unknown(const dpde_program& program) const;
  Eigen::Index size_of(const model::Unknown& unknown) const;

  Session& session_;
  std::vector<Part> parts_;
  std::map<std::string, std::vector<double>> own_;
  Eigen::VectorXd start_;
  std::vector<std::string> formulas_;  // programs of formulas with a derivative by the unknowns
  bool formulas_vary_ = false;         // they read an unknown, whether there is a derivative by it or not
  const GradientResult* last_ = nullptr;
  std::optional<model::WallMisfit> misfit_;
};

}  // namespace dpde::driver
