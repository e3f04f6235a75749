// SPDX-License-Identifier: Apache-2.0
// A*x = b on the cells of a grid: x is the pseudo-inverse solution, of all x for which |A*x - b| is least the smallest.
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

/// Of the iterations of cg, bicgstab and gmres; automatic: by multigrid where that fits, else what does. network: of cg
/// and gmres, what the caller of solve() has.
enum class Preconditioning { automatic, multigrid, none, network };

struct SolveOptions {
  SolverMethod method = SolverMethod::automatic;
  double tolerance =
      1e-12;  // of |A*x - b|/|b|, or what rounding of A*x leaves; of methods without steps it is at least 1e-9
  int most_iterations = 200;
  SmootherKind smoother = SmootherKind::automatic;  // of multigrid
  Preconditioning preconditioning = Preconditioning::automatic;
  std::string network = {};   // its name
  double rounding = 0x1p-52;  // relative error of the entries: what sums to less is 0
  bool operator==(const SolveOptions&) const = default;
};

struct SolveReport {
  SolverMethod method = SolverMethod::direct;
  int iterations = 0;
  int unaided = 0;          // of them those for which a network's direction was of no use
  double residual = 0;      // |A*x - b|/|b|, of the part of b that A reaches; of Fourier series that of the first solve
  double bound = 0;         // to which it had to come
  double incompatible = 0;  // the part that it does not reach, over |b|
  bool converged = true;
  bool is_indefinite = false;     // found by cg: it went on for no more
  bool is_singular = false;       // what is left of b is out of reach
  bool is_least_squares = false;  // by the inverse of all of a singular A that is not symmetric
};

class LinearSolver {
 public:
  /// It keeps the operator where its method needs it. Results have the same bits by any number of threads.
  /// \throws dpde::Error where the method does not fit the operator: why.
  LinearSolver(std::shared_ptr<const GridOperator> grid_operator, SolveOptions options, const Team& team = 1);
  LinearSolver(StencilMatrix matrix, const SolveOptions& options, const Team& team = 1)
      : LinearSolver(std::make_shared<GridOperator>(std::move(matrix), options.rounding), options, team) {}
  ~LinearSolver();

  /// Nothing is allocated. `x`: the first guess of methods that have one. `search`: where a network preconditions, what
  /// it makes of a residual whose mean square is 1; it may be anything.
  SolveReport solve(std::span<const double> b, std::span<double> x, const VectorFunction* search = nullptr);
  /// By Fourier series that have been right before, from field to field, each number read and written once. Nothing
  /// where there are none, or where b or x has numbers that are none: then x may be written, and solve() says why.
  std::optional<SolveReport> solve_rows(const ReadRowsOf<double>& b, const WriteRowsOf<double>& x);
  std::optional<SolveReport> solve_rows(const ReadRowsOf<float>& b, const WriteRowsOf<float>& x);
  /// solve_rows in floats leaves a residual, in f64, within what rounding leaves of a transform: of operators whose
  /// entries are no more exact.
  bool has_floats() const;
  /// x = the sum of multiples of `guesses`, one behind the other, that leaves the least of b; 0 where there is none.
  /// What no image shows is taken from the guesses.
  void begin(std::span<const double> b, std::span<double> guesses, std::span<double> x);
  const std::shared_ptr<const GridOperator>& grid_operator() const;
  /// For another, in whose place renew() puts one: until then it is of no use. keep_operator(): for its memory alone.
  std::shared_ptr<const GridOperator> give_operator();
  void keep_operator(std::shared_ptr<const GridOperator> grid_operator);
  /// Becomes the solver of another operator on the same grid, in its memory. False where a new one would be another, by
  /// its method, smoother or levels, or where the method cannot: then it is of no use. Multigrid, iterations with it or
  /// without a preconditioner, and elimination along a line allocate nothing; sparse factors keep their order.
  bool renew(std::shared_ptr<const GridOperator> grid_operator);
  SolverMethod method() const;
  bool has_first_guess() const;  // the method begins with what `x` is
  /// One sentence.
  const std::string& reason() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dpde
