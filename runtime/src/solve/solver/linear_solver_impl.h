// SPDX-License-Identifier: Apache-2.0
// Implementation of LinearSolver, for all methods.
#pragma once

#include <Eigen/IterativeLinearSolvers>
#include <optional>
#include <string>
#include <vector>

#include "solve/fourier/fourier.h"
#include "solve/matrix/direct.h"
#include "solve/matrix/null_space.h"
#include "solve/matrix/tridiagonal.h"
#include "solve/multigrid/float_cycles.h"
#include "solve/multigrid/line_systems.h"
#include "solve/multigrid/multigrid.h"
#include "solve/operator/gmres.h"
#include "solve/operator/krylov.h"
#include "solve/solver/first_guess.h"
#include "solve/solver/linear_solver.h"

namespace dpde {

/// Isolated parts of a grid, as between obstacles: those on which the equation determines the solution only up to a
/// constant.
struct Rooms {
  std::size_t count = 0, covered = 0, cells = 0;

  Rooms() = default;
  Rooms(const NullSpace& null_space, std::size_t all);
  bool operator==(const Rooms&) const = default;
  std::string words() const;
};

struct LinearSolver::Impl {
  Impl(std::shared_ptr<const GridOperator> given, SolveOptions wanted, const Team& of)
      : options(std::move(wanted)), team(of), a(std::move(given)), largest_row(a->largest_row()) {
    if (options.method == SolverMethod::automatic) options.preconditioning = Preconditioning::automatic;  // included
    const auto size = static_cast<std::size_t>(a->size());
    choose();
    if (has_own_right()) right.assign(size, 0.0);
    if (has_steps() && !is_packed) size_iterations(size);
    rooms = Rooms(null_space(), size);
    reason += rooms.words();
  }

  void choose();
  bool renew(std::shared_ptr<const GridOperator> given);
  bool renew_method();
  const NullSpace& null_space() const { return a->null_space(); }
  bool try_tridiagonal();
  bool try_fourier();
  bool try_multigrid(SolverMethod wanted);
  void make_direct(const char* why);
  void make_unsymmetric(SolverMethod wanted);
  void make_symmetric();
  void make_unpreconditioned();
  void precondition_by_network();
  void search_along(std::span<const double> r, std::span<double> z) const;
  bool is_flexible() const { return options.preconditioning == Preconditioning::network; }
  void precondition_by_multigrid();
  bool has_incomplete_factors() const;
  void make_divided_by_diagonal();
  void divide_by_diagonal(std::span<const double> r, std::span<double> z) const;
  void make_iterations(VectorFunction precondition);
  void size_iterations(std::size_t size);
  SolveReport solve_by_known_waves(std::span<const double> b, std::span<double> x);
  template <class Real>
  std::optional<SolveReport> solve_rows(const ReadRowsOf<Real>& b, const WriteRowsOf<Real>& x);
  IterationReport iterate(std::span<const double> b, std::span<double> x);
  IterationReport iterate_with_floats(std::span<const double> b, std::span<double> x);
  IterationReport iterate_packed(std::span<const double> b, std::span<double> x);
  void judge(std::span<const double> b, std::span<const double> x, const IterationReport& way, SolveReport& report);
  double left_of(std::span<const double> b, std::span<const double> x, const IterationReport& way);
  /// Rounding of A*x relative to |x|. Iterations reach f64 accuracy even for fields in f32, since their matrix is in
  /// f64. With f32 rounding it would be 5 times a right side of lap(x) - 1e-3*x on 48^2 cells, and no iteration would
  /// be made.
  double rounding_of_x() const { return 8 * (has_steps() ? 0x1p-52 : options.rounding) * largest_row; }
  MultigridOptions cycles(bool are_symmetric) const {
    return {options.rounding, are_symmetric, a->is_known_symmetric(), options.smoother, team};
  }
  bool has_steps() const { return iterations || gmres || is_packed || in_floats.cycles; }
  bool has_own_right() const { return !has_steps() || !null_space().is_empty(); }
  /// Entries of scenes in f32 are no more accurate than floats.
  bool takes_floats() const { return options.rounding > 0x1p-30 && !in_floats.are_too_few; }
  bool try_floats(SolverMethod wanted);
  bool become_doubles();
  std::string words_on_cycles(SmootherKind smoother) const;
  double out_of_reach(std::span<const double> b, std::span<const double> x) const;

  SolveOptions options;
  Team team;
  std::shared_ptr<const GridOperator> a;
  std::vector<double> diagonal;  // if the preconditioner divides by it
  FirstGuess first_guess;
  double largest_row;        // norm
  std::string no_multigrid;  // the reason
  SolverMethod method = SolverMethod::direct;
  std::string reason;
  Rooms rooms;
  std::optional<DirectSolver> direct;
  std::optional<TridiagonalSolver> tridiagonal;
  std::optional<FourierSolver> fourier;
  std::optional<LineSystems> lines;
  std::optional<double> fourier_residual;  // of the first accurate solve by either
  std::optional<Multigrid> multigrid;
  struct {
    std::optional<FloatCycles> cycles;  // in place of it
    bool are_too_few = false;           // continue with doubles
  } in_floats;
  Eigen::IncompleteLUT<double> incomplete;
  std::optional<Iterations> iterations;
  std::optional<Gmres> gmres;
  const VectorFunction* search = nullptr;  // of the current solve: the preconditioning network
  std::vector<double> right;               // without the part outside of the range; empty: b itself
  bool is_packed = false;                  // multigrid, or conjugate gradients with it, in multigrid's cell order
  struct {
    Numbers right, x;
  } packed;
};

}  // namespace dpde
