// SPDX-License-Identifier: Apache-2.0
// Derivatives of linear solves. For A*x = b, x the smallest of the best solutions,
//   x_dot = A^+(b_dot - A_dot*x),   b_bar = A^+T*x_bar =: m,   A_bar = -m*x^T,
// that is one solve with the same operator or its transpose; the steps of a solver are not differentiated. Where F(x) =
// b is not linear the implicit function theorem says the same, with A the tangent of F by x at the solution and F_dot
// in the place of A_dot*x: none of the steps of Newton's method has a derivative. (The derivative of A^+ has two more
// terms, Golub and Pereyra 1973, eq. 4.12; they are 0 while the null spaces of A and of its transpose stay as they
// are.) What A_dot*x and A_bar are made of is the operator's own tangent and adjoint, taken of a copy with names of its
// own.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "adjoint/check/extremes.h"
#include "support/contains.h"

namespace dpde::adjoint {

/// Whether what the operator reads beside the unknown varies.
bool has_varied_operator(const stencil::Module& module, const stencil::Solve& solve, const Varied& varied);

/// Adds the kernels that the program runs.
void add_kernels(stencil::Module& to, const stencil::Module& from, const stencil::Program& program);

/// The solve for `unknowns`, with names of its own for what the block writes; its kernels go to `kernels`.
stencil::Solve copy_of(const stencil::Module& module, const stencil::Solve& solve,
                       const std::vector<std::string>& unknowns, DerivedNames& names, stencil::Module& kernels);

/// The linear solve for `rates` of the unknowns, at the solution where the solve is not linear: its block is the
/// tangent of a copy of the solve's block by its unknowns. Its right sides are the caller's.
stencil::Solve linearised(const stencil::Module& module, const stencil::Program& program, const stencil::Solve& solve,
                          const std::vector<std::string>& rates, DerivedNames& names, stencil::Module& kernels);

/// The operator as a program that may stand outside of a solve: of what it reads, the unknown too, it has copies, and
/// fills these.
struct OperatorCopy {
  stencil::Module module;
  stencil::Program program;
  std::vector<std::string> images;
  std::vector<std::pair<std::string, std::string>> inputs;  // and their copies
  std::vector<std::string> unknowns;                        // as outside

  /// Whether the input varies and is no unknown.
  bool is_active(const std::string& input, const Varied& varied) const {
    return !contains(unknowns, input) && varied.fields.contains(input);
  }
  /// The copies of the active inputs, and the parameters that vary.
  Activity activity(const Varied& varied) const;
};
OperatorCopy copy_with_inputs(const stencil::Module& module, const stencil::Solve& solve,
                              const stencil::Program& program, DerivedNames& names);

/// Appends what makes the copies.
void add_copies(const OperatorCopy& copy, const Writing& into);

}  // namespace dpde::adjoint
