// SPDX-License-Identifier: Apache-2.0
// Iterative methods: conjugate gradients (Hestenes and Stiefel 1952) for symmetric definite operators, and BiCGStab
// (van der Vorst 1992) for others. Flexible conjugate gradients (Notay 2000) allow any function as preconditioner: it
// only chooses search directions; the step lengths are optimal.
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
  int unaided = 0;  // iterations in which an arbitrary preconditioner did not help
};

/// Iterations without progress before a method gives up: as many as GMRES has vectors.
inline constexpr int least_patience = 40;

/// Bit-identical for any number of threads, as all vector operations here (solve/operator/vector_parts.h).
double dot(std::span<const double> a, std::span<const double> b, const Team& team = 1);
double norm(std::span<const double> a, const Team& team = 1);
/// y += c*x
void add_multiple(double c, std::span<const double> x, std::span<double> y, const Team& team = 1);
void copy_vector(std::span<const double> from, std::span<double> to, const Team& team = 1);

/// For a solution whose numbers are in another order than those of other vectors.
struct SolutionOrder {
  VectorFunction pack;                                                                // packs x to a vector
  std::function<void(double c, std::span<const double> p, std::span<double> x)> add;  // x += c*p
};

enum class IterationMethod { cg, flexible_cg, bicgstab };

/// The iterations and their vectors. Results are always finite and never worse than the first guess.
class Iterations {
 public:
  /// `project` removes the null space from directions of a flexible preconditioner; empty for a regular operator.
  /// `team`: for vector operations.
  Iterations(VectorFunction multiply, VectorFunction precondition, double tolerance, int most,
             VectorFunction project = {}, const Team& team = 1)
      : multiply_(std::move(multiply)),
        precondition_(std::move(precondition)),
        project_(std::move(project)),
        tolerance_(tolerance),
        most_(most),
        team_(team) {}

  /// Allocates the memory of a method.
  void resize(std::size_t size, IterationMethod method);
  /// Memory in which the right side of cg may be, since cg reads it only at the beginning.
  std::span<double> room() { return p_; }
  /// `order`: that of x, if it differs.
  IterationReport cg(std::span<const double> b, std::span<double> x, const SolutionOrder* order = nullptr);
  /// If a direction of the preconditioner does not help, the residual is used. From then on permanently, if
  /// least_patience iterations do not halve the residual, or if the true residual is larger than the recursive one.
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
