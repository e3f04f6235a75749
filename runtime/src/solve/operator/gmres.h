// SPDX-License-Identifier: Apache-2.0
// GMRES (Saad and Schultz 1986): minimises the residual over the Krylov space, for any operator. Restarted, so that
// memory is bounded, and preconditioned from the right, so that the residual is that of A. Flexible variant (Saad
// 1993): the preconditioner may be any function, and its results are stored.
#pragma once

#include <vector>

#include "solve/operator/krylov.h"

namespace dpde {

class Gmres {
 public:
  /// `restart`: number of stored vectors. `most`: iterations, one multiplication each. `rounding`: relative error of
  /// the operator; new directions below it are dropped.
  Gmres(VectorFunction multiply, VectorFunction precondition, double tolerance, int most, int restart,
        double rounding = 0x1p-52, bool is_flexible = false, VectorFunction project = {}, const Team& team = 1)
      : multiply_(std::move(multiply)),
        precondition_(std::move(precondition)),
        project_(std::move(project)),
        tolerance_(tolerance),
        most_(most),
        restart_(restart),
        is_flexible_(is_flexible),
        nothing_(4 * rounding),
        team_(team) {}

  /// Allocates all memory.
  void resize(std::size_t size);
  /// Starts from `x` and never increases the residual. Gives up if a full cycle between two restarts does not halve the
  /// residual; the flexible variant then first drops its preconditioner.
  IterationReport solve(std::span<const double> b, std::span<double> x);
  std::size_t vectors() const { return basis_.size(); }

 private:
  double dot(std::span<const double> a, std::span<const double> b) const { return dpde::dot(a, b, team_); }
  double norm(std::span<const double> a) const { return dpde::norm(a, team_); }
  double find_residual(std::span<const double> b, std::span<const double> x);
  int make_basis(double left, double enough, int most);
  const Numbers& search(std::size_t j);
  bool add_direction(std::size_t j);
  void rotate(std::size_t j);
  void correct(int count, std::span<double> x);
  double& upper(std::size_t i, std::size_t j) { return upper_[j * (basis_.size()) + i]; }

  VectorFunction multiply_, precondition_, project_;  // project: see Iterations
  double tolerance_;
  int most_, restart_;
  bool is_flexible_, is_plain_ = false;  // plain: without its preconditioner
  double nothing_;
  Team team_;
  int unaided_ = 0;                // directions of a flexible preconditioner that did not help
  std::vector<Numbers> basis_;     // orthonormal; restart + 1
  std::vector<Numbers> searched_;  // results of a flexible preconditioner for each
  Numbers work_, before_;
  std::vector<double> upper_, cosine_, sine_, right_;  // of the least-squares problem, triangular by rotations
};

}  // namespace dpde
