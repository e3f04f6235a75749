// SPDX-License-Identifier: Apache-2.0
// A*x = b on the cells of a grid: x is the pseudo-inverse solution, the least-squares solution of smallest norm.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "dpde/runtime/team.h"
#include "solve/fourier/grid_waves.h"
#include "solve/matrix/stencil_matrix.h"
#include "solve/multigrid/smoother.h"
#include "solve/operator/grid_operator.h"
#include "solve/operator/vector_function.h"

namespace dpde {

inline constexpr int vectors_of_gmres = 40;          // between restarts
inline constexpr std::int64_t small_system = 10000;  // factors of so many cells cost no more than cycles, and are exact

enum class SolverMethod { automatic, direct, tridiagonal, fourier, multigrid, cg, bicgstab, gmres };
std::string_view name_of(SolverMethod method);

/// Preconditioner of cg, bicgstab and gmres. automatic: multigrid if it suits the operator, else another one. network:
/// for cg and gmres, given by the caller of solve().
enum class Preconditioning { automatic, multigrid, none, network };

struct SolveOptions {
  SolverMethod method = SolverMethod::automatic;
  double tolerance = 1e-12;  // of |A*x - b|/|b|, or rounding of A*x; for non-iterative methods at least 1e-9
  int most_iterations = 200;
  SmootherKind smoother = SmootherKind::automatic;  // of multigrid
  Preconditioning preconditioning = Preconditioning::automatic;
  std::string network = {};   // its name
  double rounding = 0x1p-52;  // relative error of the entries: smaller sums count as 0
  bool operator==(const SolveOptions&) const = default;
};

struct SolveReport {
  SolverMethod method = SolverMethod::direct;
  int iterations = 0;
  int unaided = 0;          // iterations in which a network's direction did not help
  double residual = 0;      // |A*x - b|/|b| for b in the range of A; for Fourier series that of the first solve
  double bound = 0;         // the bound that it had to reach
  double incompatible = 0;  // part of b outside of the range of A, over |b|
  bool converged = true;
  bool is_indefinite = false;     // found by cg, which then stopped
  bool is_singular = false;       // the residual is outside of the range
  bool is_least_squares = false;  // by the dense inverse of a singular A that is not symmetric
};

class LinearSolver {
 public:
  /// Stores the operator if its method needs it. Results are bit-identical for any number of threads.
  /// \throws dpde::Error with the reason if the method does not suit the operator.
  LinearSolver(std::shared_ptr<const GridOperator> grid_operator, SolveOptions options, const Team& team = 1);
  LinearSolver(StencilMatrix matrix, const SolveOptions& options, const Team& team = 1)
      : LinearSolver(std::make_shared<GridOperator>(std::move(matrix), options.rounding), options, team) {}
  ~LinearSolver();

  /// Allocates nothing. `x`: first guess, for methods that use one. `search`: the preconditioning network, applied to a
  /// residual with mean square 1; any function.
  SolveReport solve(std::span<const double> b, std::span<double> x, const VectorFunction* search = nullptr);
  /// By Fourier series that were accurate before, from field to field, reading and writing each number once. Returns
  /// nothing if there are none, or if b or x is not finite: x may then be written, and solve() gives the reason.
  std::optional<SolveReport> solve_rows(const ReadRowsOf<double>& b, const WriteRowsOf<double>& x);
  std::optional<SolveReport> solve_rows(const ReadRowsOf<float>& b, const WriteRowsOf<float>& x);
  /// Whether solve_rows in floats has a residual, in f64, within the rounding of a transform. Only for operators whose
  /// entries are no more accurate.
  bool has_floats() const;
  /// x = the linear combination of `guesses` (one after the other) with the smallest residual; 0 if there are none.
  /// Removes the null space from the guesses.
  void begin(std::span<const double> b, std::span<double> guesses, std::span<double> x);
  const std::shared_ptr<const GridOperator>& grid_operator() const;
  /// Gives up the operator before renew() with another one; the solver is unusable until then. keep_operator(): only
  /// holds memory.
  std::shared_ptr<const GridOperator> give_operator();
  void keep_operator(std::shared_ptr<const GridOperator> grid_operator);
  /// Becomes the solver of another operator on the same grid, reusing memory. False if a new solver would have another
  /// method, smoother or number of levels, or if the method cannot be renewed; the solver is then unusable. Multigrid,
  /// iterations with it or without a preconditioner, and elimination along a line allocate nothing; sparse factors keep
  /// their order.
  bool renew(std::shared_ptr<const GridOperator> grid_operator);
  SolverMethod method() const;
  bool has_first_guess() const;  // the method starts from `x`
  /// One sentence on the choice of the method.
  const std::string& reason() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dpde
