// SPDX-License-Identifier: Apache-2.0
// A solve that is not linear, by Newton's method: dpde_solve of kernel_abi.h with a step.
//
// x begins with b and gets F'(x)^-1*(b - F(x)), where F' is the compiled tangent of F, until a step changes no field by
// more than the tolerance, as a part of its largest value. That step is taken too, so that what is left is the square
// of it, or rounding. A step that makes what is left grow much is halved. Where steps themselves grow more than once it
// is given up: what it then might find is another solution. Not where no more is left of right sides than what rounding
// of the unknowns makes of them: a small field beside a large one that its equation reads has no nearer solution. Each
// solve begins anew: it remembers nothing.
#pragma once

#include "exec/coupled_solve.h"
#include "solve/solver/solver_shelf.h"

namespace dpde {

class NewtonSolve {
 public:
  NewtonSolve() = default;
  /// `shelf`: of the program.
  NewtonSolve(const dpde_solve& solve, const dpde_program& program, const dpde_layout& layout, SolverShelf& shelf);

  /// \throws NoSolution where it does not converge: what is left, and what to try.
  void run(void* const* fields, const double* params, const std::function<void()>& apply,
           const std::function<void()>& apply_step);
  /// Of its vectors, and of what a step holds.
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
  double nothing_ = 0;  // below which what is left of right sides has lost digits: a change of that size is none
  std::vector<double> changes_;  // of each field, in the step before
  std::vector<double> moved_;    // of the images of each field: the most that moves of unknowns by rounding change
  double twice_rounded_ = 0;     // below which a change is none, of the largest field
  FieldGroup images_, rights_, unknowns_, step_rights_, step_unknowns_;
  CoupledSolve step_;
  std::vector<double> right_, x_, next_, left_, change_, kept_;
  SolveNote* note_ = nullptr;  // on the shelf
};

}  // namespace dpde
