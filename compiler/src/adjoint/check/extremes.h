// SPDX-License-Identifier: Apache-2.0
// The derivative of m = max u (or min u) over some axes, shared equally by the cells that have the value m:
//   m_dot = sum(e*u_dot)/sum(e) and u_bar = e*sum(m_bar)/sum(e), with e = 1 where u = m and 0 elsewhere.
// Both are computed by kernels and sums, so that they can be differentiated again. At a tie this is the mean of the
// one-sided derivatives; the second derivative is that for the current set of tied cells.
#pragma once

#include <string>
#include <vector>

#include "adjoint/reverse/plan.h"
#include "stencil/stencil.h"

namespace dpde::adjoint {

bool is_extreme(const stencil::Reduce& reduce);

/// `value` where the reduced field has the extreme value, 0 elsewhere.
stencil::Expr at_extreme(const stencil::Reduce& reduce, const stencil::Expr& value);

/// The derived program under construction.
struct Writing {
  const stencil::Program& primal;
  std::string suffix;  // of its kernels, after the name of the primal
  DerivedNames& names;
  stencil::Module& kernels;
  std::vector<stencil::Statement>& body;
};

/// Appends a kernel, PRIMAL SUFFIX_what, that stores `value` in `field`.
void add_store(const std::string& field, const stencil::Expr& value, const std::string& what, const Writing& into);

/// Appends statements that count the cells with the extreme value; returns the field with the count.
std::string add_count_of_ties(const stencil::Reduce& reduce, const Writing& into);

/// Appends statements that store m_dot, after the reduction itself.
void add_tangent_of_extreme(const stencil::Reduce& reduce, const Writing& into);

}  // namespace dpde::adjoint
