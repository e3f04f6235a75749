// SPDX-License-Identifier: Apache-2.0
// Derivatives of linear solves. For A*x = b, with x the minimum-norm least-squares solution,
//   x_dot = A^+(b_dot - A_dot*x),   b_bar = A^+T*x_bar =: m,   A_bar = -m*x^T,
// that is one solve with the same operator or its transpose; the iterations of a solver are not differentiated. For a
// nonlinear F(x) = b the implicit function theorem gives the same, with A the tangent of F by x at the solution and
// F_dot instead of A_dot*x: the steps of Newton's method are not differentiated. (The derivative of A^+ has two more
// terms, Golub and Pereyra 1973, eq. 4.12; they are 0 while the null spaces of A and of its transpose do not change.)
// A_dot*x and A_bar are computed by the tangent and adjoint of a copy of the operator with names of its own.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "adjoint/check/extremes.h"
#include "support/contains.h"

namespace dpde::adjoint {

/// Whether a coefficient of the operator varies.
bool has_varied_operator(const stencil::Module& module, const stencil::Solve& solve, const Varied& varied);

/// Adds the kernels that the program runs.
void add_kernels(stencil::Module& to, const stencil::Module& from, const stencil::Program& program);

/// A copy of the solve, for `unknowns`, with new names for all fields that the block writes; adds its kernels to
/// `kernels`.
stencil::Solve copy_of(const stencil::Module& module, const stencil::Solve& solve,
                       const std::vector<std::string>& unknowns, DerivedNames& names, stencil::Module& kernels);

/// The linear solve for the tangents `rates` of the unknowns; for a nonlinear solve it is linearised at the solution.
/// Its block is the tangent of a copy of the solve's block by the unknowns. The caller sets its right sides.
stencil::Solve linearised(const stencil::Module& module, const stencil::Program& program, const stencil::Solve& solve,
                          const std::vector<std::string>& rates, DerivedNames& names, stencil::Module& kernels);

/// The operator as a program that can run outside a solve: it has and fills copies of all its inputs, including the
/// unknowns.
struct OperatorCopy {
  stencil::Module module;
  stencil::Program program;
  std::vector<std::string> images;
  std::vector<std::pair<std::string, std::string>> inputs;  // each with its copy
  std::vector<std::string> unknowns;                        // names outside

  /// Whether the input varies and is not an unknown.
  bool is_active(const std::string& input, const Varied& varied) const {
    return !contains(unknowns, input) && varied.fields.contains(input);
  }
  /// The copies of the active inputs, and the parameters that vary.
  Activity activity(const Varied& varied) const;
};
OperatorCopy copy_with_inputs(const stencil::Module& module, const stencil::Solve& solve,
                              const stencil::Program& program, DerivedNames& names);

/// Appends the statements that make the copies.
void add_copies(const OperatorCopy& copy, const Writing& into);

}  // namespace dpde::adjoint
