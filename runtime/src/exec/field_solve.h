// SPDX-License-Identifier: Apache-2.0
// A linear solve of a program for one field, resolved for one layout (dpde_solve of kernel_abi.h).
//
// The rows of the operator are found by running its operations on unit vectors (solve/operator_probe.h), when it is
// first needed and where a coefficient or parameter has changed; the solver for it is kept, and becomes the next one
// in its place, so that steps whose coefficients change take no memory from the second time on. A solve begins with 0
// or with fields of the program, so that it remembers nothing of those before. What the step has solved its adjoint
// finds on tapes, as they are in the field: those of the same solver, of the same right side and the same guesses by a
// hash of 64 bits.
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
  /// `shelf`: of the program.
  FieldSolve(const dpde_solve& solve, const dpde_program& program, const dpde_layout& layout,
             std::shared_ptr<SolverShelf> shelf);

  /// `apply` runs the operations, `precondition` the network, if there is one. `fields` point at their cells (0,0,0).
  /// \throws NoSolution where there is none to the tolerance: it says why.
  void run(void* const* fields, const double* params, const std::function<void()>& apply,
           const std::function<void()>& precondition);

  /// The field of the program.
  int unknown() const { return solve_.unknowns[0]; }
  /// Of its vectors, and of the solver that solves with the same operator share. Operators are taken to be the same
  /// where they reach as far by the same method, with the same coefficients.
  std::vector<OwnedMemory> memory(const std::string& owner) const;
  /// Bytes of the tape of a run.
  std::int64_t tape_bytes() const;
  /// Runs write one while `tapes` records.
  void write_tapes(std::shared_ptr<Tapes> tapes) { written_to_ = std::move(tapes); }
  /// Runs take the solution of one that fits, if there is one, and give the tape back.
  void read_tapes(std::shared_ptr<Tapes> tapes) { read_from_ = std::move(tapes); }

 private:
  /// Tapes are found by the solver and by a hash of the right side and of the guesses that it looks at.
  struct TapeKey {
    const LinearSolver* solver = nullptr;
    std::uint64_t hash = 0;
  };
  /// One behind the other.
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
  std::shared_ptr<SolveVectors> vectors_;  // from the first run on
  OperatorProbe probe_;
  std::shared_ptr<const GridOperator> operator_;  // made by `probe_`, by that of another solve, or null
  SolveOptions options_;                          // wanted_, but for the method where that does not fit
  std::string why_not_;
  std::shared_ptr<SolverShelf> shelf_;
  SolveNote* note_ = nullptr;  // on the shelf
  std::shared_ptr<LinearSolver> solver_;
  struct {
    std::string of_solver, all;  // as the solver said it, and with what is said beside
  } reason_;                     // why it is this one
  std::shared_ptr<Tapes> written_to_, read_from_;
};

}  // namespace dpde
