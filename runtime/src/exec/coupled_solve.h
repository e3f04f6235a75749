// SPDX-License-Identifier: Apache-2.0
// A linear solve of a program for several fields together, or within Newton's method, resolved for one layout
// (dpde_solve of kernel_abi.h). A system without a unique solution is an error.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/owned_memory.h"
#include "dpde/runtime/solve_note.h"
#include "solve/operator/coupled_matrix.h"
#include "solve/solver/solve_inputs.h"

namespace dpde {

/// The values of some fields of a program, one field after the other.
class FieldGroup {
 public:
  FieldGroup() = default;
  FieldGroup(const int32_t* fields, int32_t count, const dpde_layout& layout)
      : numbers_(fields, static_cast<std::size_t>(count)), layout_(layout), cells_(cells_of(layout)) {}

  std::size_t size() const { return numbers_.size() * cells_; }
  std::size_t cells() const { return cells_; }
  void read(void* const* fields, std::span<double> values) const;
  void write(void* const* fields, std::span<const double> values) const;

 private:
  std::span<const int32_t> numbers_;
  dpde_layout layout_{};
  std::size_t cells_ = 0;
};

/// "u, v, w"
std::string names_of_unknowns(const dpde_solve& solve, const dpde_program& program);
/// Largest magnitude; NaN if a value is NaN.
double largest_size(std::span<const double> values);

class CoupledSolve {
 public:
  CoupledSolve() = default;
  /// `note` must outlive the object.
  CoupledSolve(const dpde_solve& solve, const dpde_program& program, const dpde_layout& layout, SolveNote& note);

  /// `apply` runs the operations. `fields` point at their cells (0,0,0).
  /// \throws NoSolution with the reason if the tolerance is not reached.
  void run(void* const* fields, const double* params, const std::function<void()>& apply);
  /// Memory of its vectors and of the matrix.
  std::vector<OwnedMemory> memory(const std::string& owner) const;

 private:
  void refine(void* const* fields, const std::function<void()>& apply);
  [[noreturn]] void fail(const std::string& why, const char* advice, double residual) const;

  std::string names_;
  SolveInputs inputs_;
  FieldGroup images_, rights_, unknowns_;
  std::shared_ptr<CoupledMatrix> matrix_;
  bool is_made_ = false;
  double near_ = 0;  // a larger relative correction of the solution is not rounding
  std::vector<double> right_, solution_, left_, correction_;
  SolveNote* note_ = nullptr;
};

}  // namespace dpde
