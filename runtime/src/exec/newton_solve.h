// SPDX-License-Identifier: Apache-2.0
// A nonlinear solve by Newton's method: dpde_solve of kernel_abi.h with a step.
//
// Solves F(x) = b from x = b with the increments F'(x)^-1*(b - F(x)), where F' is the compiled tangent of F. Stops when
// no field changes by more than the tolerance, relative to its largest value; that increment is still added, so the
// residual is about its square, or rounding. An increment that makes the residual grow much is halved. If increments
// grow more than once the solve fails, since it might converge to another solution; unless the residual is at the level
// that rounding of the unknowns causes: then a small field whose equation reads a large one cannot be more accurate.
// Solves do not depend on earlier ones.
#pragma once

#include "exec/coupled_solve.h"
#include "solve/solver/solver_shelf.h"

namespace dpde {

class NewtonSolve {
 public:
  NewtonSolve() = default;
  /// `shelf`: shared by the solves of the program.
  NewtonSolve(const dpde_solve& solve, const dpde_program& program, const dpde_layout& layout, SolverShelf& shelf);

  /// \throws NoSolution with residual and advice if it does not converge.
  void run(void* const* fields, const double* params, const std::function<void()>& apply,
           const std::function<void()>& apply_step);
  /// Memory of its vectors, and of its linear solve.
  std::vector<OwnedMemory> memory(const std::string& owner) const;

 private:
  double distance(void* const* fields, const std::function<void()>& apply);
  double relative_change();
  bool is_rounding_left(void* const* fields, const std::function<void()>& apply);
  double move(void* const* fields, const std::function<void()>& apply, double before, bool may_halve);
  void note(int steps);
  void solve_step(void* const* fields, const double* params, const std::function<void()>& apply_step, int k);
  [[noreturn]] void fail(const std::string& why, double residual) const;
  [[noreturn]] void fail(int steps, double left) const;

  std::string names_;
  double tolerance_ = 0, loose_ = 0;
  double rounding_ = 0;
  double nothing_ = 0;           // smaller residuals have lost digits to underflow: changes of that size do not count
  std::vector<double> changes_;  // of each field, in the previous step
  std::vector<double>
      moved_;  // of the image of each field: largest change under perturbations of the unknowns by rounding
  double twice_rounded_ = 0;  // smaller changes, relative to the largest field, do not count
  FieldGroup images_, rights_, unknowns_, step_rights_, step_unknowns_;
  CoupledSolve step_;
  std::vector<double> right_, x_, next_, left_, change_, kept_;
  SolveNote* note_ = nullptr;  // on the shelf
};

}  // namespace dpde
