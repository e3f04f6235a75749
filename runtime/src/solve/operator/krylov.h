// SPDX-License-Identifier: Apache-2.0
// Methods that come nearer step by step: conjugate gradients (Hestenes and Stiefel 1952), of symmetric definite
// operators, and BiCGStab (van der Vorst 1992) of others. Flexible conjugate gradients (Notay 2000) have a
// preconditioner that may be anything: it chooses where they look, and how far they go is the best there.
#pragma once

#include <functional>
#include <span>

#include "dpde/runtime/team.h"
#include "solve/operator/numbers.h"
#include "solve/operator/vector_function.h"

namespace dpde {

struct IterationReport {
  int iterations = 0;
  double residual = 0;  // |A*x - b|/|b|
  bool converged = false, is_indefinite = false;
  int unaided = 0;  // iterations for which a preconditioner that may be anything was of no use
};

/// Iterations that come no nearer before something is given up: as many as GMRES has vectors.
inline constexpr int least_patience = 40;

/// Of the same bits by any number of threads, as all that is done with vectors here (solve/vector_parts.h).
double dot(std::span<const double> a, std::span<const double> b, const Team& team = 1);
double norm(std::span<const double> a, const Team& team = 1);
/// y += c*x
void add_multiple(double c, std::span<const double> x, std::span<double> y, const Team& team = 1);
void copy_vector(std::span<const double> from, std::span<double> to, const Team& team = 1);

/// Of a solution whose numbers stand in another order than those of other vectors.
struct SolutionOrder {
  VectorFunction pack;                                                                // a vector of x
  std::function<void(double c, std::span<const double> p, std::span<double> x)> add;  // x += c*p
};

enum class IterationMethod { cg, flexible_cg, bicgstab };

/// Memory for the vectors of one size. What is found is never further from a solution than what they begin with, and
/// never a number that is none.
class Iterations {
 public:
  /// `project` takes from directions of a flexible preconditioner what no image shows; of a regular operator there is
  /// none. `team`: of what is done with vectors.
  Iterations(VectorFunction multiply, VectorFunction precondition, double tolerance, int most,
             VectorFunction project = {}, const Team& team = 1)
      : multiply_(std::move(multiply)),
        precondition_(std::move(precondition)),
        project_(std::move(project)),
        tolerance_(tolerance),
        most_(most),
        team_(team) {}

  /// All the memory that one of them needs.
  void resize(std::size_t size, IterationMethod method);
  /// Where the right side of cg may be, which it reads at its beginning alone.
  std::span<double> room() { return p_; }
  /// `order`: of x, where that is another one.
  IterationReport cg(std::span<const double> b, std::span<double> x, const SolutionOrder* order = nullptr);
  /// Where a direction of the preconditioner is of no use, the residual is the direction. It is from then on where
  /// least_patience iterations do not halve it, or the true residual is larger than the one that is carried along.
  IterationReport flexible_cg(std::span<const double> b, std::span<double> x);
  IterationReport bicgstab(std::span<const double> b, std::span<double> x);

 private:
  double dot(std::span<const double> a, std::span<const double> b) const { return dpde::dot(a, b, team_); }
  double norm(std::span<const double> a) const { return dpde::norm(a, team_); }
  void find_residual(std::span<const double> b, std::span<const double> x);
  bool search();
  bool has_come(std::span<const double> b, std::span<const double> x);
  double look_along(double weight);
  bool bicgstab_step(std::span<double> x);
  void bicgstab_from_here(double size, std::span<double> x, IterationReport& report);

  VectorFunction multiply_, precondition_, project_;
  double tolerance_;
  int most_;
  Team team_;
  Numbers r_, z_, p_, q_, s_, t_, v_, first_, best_;
  double rho_ = 1, alpha_ = 1, omega_ = 1;  // of BiCGStab
};

}  // namespace dpde
