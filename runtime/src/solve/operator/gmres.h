// SPDX-License-Identifier: Apache-2.0
// GMRES (Saad and Schultz 1986): of all x in the space of what has been multiplied so far the one that leaves least.
// Of any operator; restarted, so that memory is bounded, and preconditioned from the right: what is left is that of A.
// Flexible (Saad 1993): the preconditioner may be anything, and what it makes is kept.
#pragma once

#include <vector>

#include "solve/operator/krylov.h"

namespace dpde {

class Gmres {
 public:
  /// `restart`: how many vectors are kept. `most`: iterations, each of which multiplies once. `rounding`: relative
  /// error of what is multiplied by: a direction of which less is left is none.
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

  /// All the memory it needs.
  void resize(std::size_t size);
  /// Begins with what `x` is, and leaves nothing that is further from a solution. It gives up where all the vectors
  /// between two restarts do not halve what is left; a flexible one then gives its preconditioner up first.
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

  VectorFunction multiply_, precondition_, project_;  // project: as of Iterations
  double tolerance_;
  int most_, restart_;
  bool is_flexible_, is_plain_ = false;  // plain: without its preconditioner
  double nothing_;
  Team team_;
  int unaided_ = 0;                // directions of a flexible preconditioner that were of no use
  std::vector<Numbers> basis_;     // orthonormal; restart + 1
  std::vector<Numbers> searched_;  // what a flexible preconditioner makes of each
  Numbers work_, before_;
  std::vector<double> upper_, cosine_, sine_, right_;  // of the least squares, made triangular by rotations
};

}  // namespace dpde
