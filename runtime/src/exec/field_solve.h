// SPDX-License-Identifier: Apache-2.0
// A linear solve of a program for one field, resolved for one layout (dpde_solve of kernel_abi.h).
//
// The matrix rows of the operator are found by running its operations on unit vectors
// (solve/operator/operator_probe.h), on first use and after a change of a coefficient or parameter. The solver is
// cached and rebuilt in place, so that steps with changing coefficients allocate nothing from the second time on. A
// solve starts from 0 or from fields of the program: it does not depend on earlier solves. The adjoint finds solutions
// of the step on tapes, in the field's precision, by solver and a 64-bit hash of right side and guesses.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/owned_memory.h"
#include "dpde/runtime/solve_memory.h"
#include "dpde/runtime/tapes.h"
#include "solve/operator/operator_probe.h"
#include "solve/solver/linear_solver.h"
#include "solve/solver/solve_inputs.h"
#include "solve/solver/solver_shelf.h"

namespace dpde {

class FieldSolve {
 public:
  FieldSolve() = default;
  /// `shelf`: shared by the solves of the program.
  FieldSolve(const dpde_solve& solve, const dpde_program& program, const dpde_layout& layout,
             std::shared_ptr<SolverShelf> shelf);

  /// `apply` runs the operations, `precondition` the network, if there is one. `fields` point at their cells (0,0,0).
  /// \throws NoSolution with the reason if the tolerance is not reached.
  void run(void* const* fields, const double* params, const std::function<void()>& apply,
           const std::function<void()>& precondition);

  /// Index of the unknown among the fields of the program.
  int unknown() const { return solve_.unknowns[0]; }
  /// Memory of its vectors, and of the solver, which solves with the same operator share. Operators count as the same
  /// if stencil radius, method and coefficients are.
  std::vector<OwnedMemory> memory(const std::string& owner) const;
  /// Bytes of the tape of one run.
  std::int64_t tape_bytes() const;
  /// Runs write a tape each while `tapes` is recording.
  void write_tapes(std::shared_ptr<Tapes> tapes) { written_to_ = std::move(tapes); }
  /// Runs use the solution on a matching tape, if there is one, and release the tape.
  void read_tapes(std::shared_ptr<Tapes> tapes) { read_from_ = std::move(tapes); }

 private:
  /// Key of a tape: the solver, and a hash of the right side and of the guesses in use.
  struct TapeKey {
    const LinearSolver* solver = nullptr;
    std::uint64_t hash = 0;
  };
  /// All guesses, one after the other.
  std::span<double> guesses() const {
    return std::span(vectors_->guesses).first(vectors_->right.size() * static_cast<std::size_t>(solve_.guess_count));
  }
  void make_solver(void* const* fields, const std::function<void()>& apply);
  bool fits(SolverMethod method, std::shared_ptr<LinearSolver> spare = nullptr);
  template <class Real>
  std::optional<SolveReport> solve_rows_as(void* const* fields);
  bool solve_rows(void* const* fields, bool is_counted = true);
  void read_guesses(void* const* fields);
  void begin();
  void drop_solver();
  TapeKey tape_key(void* const* fields) const;
  bool find_on_tape(void* const* fields, const TapeKey& key);
  void keep_on_tape(void* const* fields, const TapeKey& key);
  double read_right(void* const* fields);
  void solve_cells(void* const* fields, double factor, const std::function<void()>& precondition);
  SolveReport solve_timed(const VectorFunction& search);
  SolveReport solve_again(const SolveReport& first);
  void note(const SolveReport& report);
  void check(const SolveReport& report) const;
  void find_operator(const LinearImage& image, LinearSolver* spare);
  ProbeRoom room_of_vectors() const;
  std::function<std::string()> advice_for(const SolveReport& report) const;
  [[noreturn]] void fail(const std::string& why, const SolveReport& report) const;

  dpde_solve solve_{};
  dpde_layout layout_{};
  std::string name_;  // of the unknown
  std::vector<std::string> made_of_;
  SolveShape shape_;
  SolveOptions wanted_;
  SolveInputs inputs_;
  std::shared_ptr<SolveVectors> vectors_;  // allocated in the first run
  OperatorProbe probe_;
  std::shared_ptr<const GridOperator> operator_;  // made by `probe_`, shared with another solve, or null
  SolveOptions options_;                          // wanted_, with another method if that one does not suit
  std::string why_not_;
  std::shared_ptr<SolverShelf> shelf_;
  SolveNote* note_ = nullptr;  // on the shelf
  std::shared_ptr<LinearSolver> solver_;
  struct {
    std::string of_solver, all;  // from the solver alone, and with additions
  } reason_;                     // why this method was chosen
  std::shared_ptr<Tapes> written_to_, read_from_;
};

}  // namespace dpde
