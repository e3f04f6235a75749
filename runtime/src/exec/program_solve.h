// SPDX-License-Identifier: Apache-2.0
// A solve of a program, of any kind.
#pragma once

#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "dpde/runtime/error.h"
#include "dpde/runtime/owned_memory.h"
#include "exec/field_solve.h"
#include "exec/newton_solve.h"

namespace dpde {

class ProgramSolve {
 public:
  ProgramSolve() = default;
  ProgramSolve(const dpde_solve& solve, const dpde_program& program, const dpde_layout& layout,
               const std::shared_ptr<SolverShelf>& shelf)
      : unknown_(program.fields[solve.unknowns[0]]) {
    if (solve.is_linear == 0) {
      solve_.emplace<NewtonSolve>(solve, program, layout, *shelf);
    } else if (solve.count > 1) {
      solve_.emplace<CoupledSolve>(solve, program, layout, shelf->add_note(names_of_unknowns(solve, program)));
    } else {
      solve_.emplace<FieldSolve>(solve, program, layout, shelf);
    }
  }

  std::vector<OwnedMemory> memory() const {
    return std::visit([&](const auto& solve) { return solve.memory("solve for " + unknown_); }, solve_);
  }

  /// Null if it is nonlinear, or for several fields.
  FieldSolve* of_field() { return std::get_if<FieldSolve>(&solve_); }

  /// `apply` runs the operations, `apply_step` those of a step of Newton's method, `precondition` the preconditioning
  /// network. They are passed by reference, which allocates nothing.
  template <class Apply, class ApplyStep, class Precondition>
  void run(void* const* fields, const double* params, const Apply& apply, const ApplyStep& apply_step,
           const Precondition& precondition) try {
    if (auto* newton = std::get_if<NewtonSolve>(&solve_)) {
      newton->run(fields, params, std::ref(apply), std::ref(apply_step));
    } else if (auto* coupled = std::get_if<CoupledSolve>(&solve_)) {
      coupled->run(fields, params, std::ref(apply));
    } else {
      std::get<FieldSolve>(solve_).run(fields, params, std::ref(apply), std::ref(precondition));
    }
  } catch (Error& error) {
    error.set_solve_for(unknown_);
    throw;
  }

 private:
  std::string unknown_;
  std::variant<FieldSolve, CoupledSolve, NewtonSolve> solve_;
};

}  // namespace dpde
