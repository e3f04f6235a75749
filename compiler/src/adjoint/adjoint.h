// SPDX-License-Identifier: Apache-2.0
// Derivatives of stencil programs as stencil programs: tangent (forward) and adjoint (reverse, gather form).
//
// Both can be applied to their own results.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "source/diagnostic.h"
#include "stencil/stencil.h"

namespace dpde::adjoint {

/// What the derivative is taken with respect to: input fields and parameters of the program.
struct Activity {
  std::set<std::string> fields;
  std::set<std::string> params;
};

/// The grid and parameters of a program, as far as known: custom adjoints are checked there.
struct Surroundings {
  struct Axis {
    int cells = 1;
    double low = 0, spacing = 1;
  };
  std::vector<Axis> axes;  // none: nothing is known
  std::map<std::string, double> params;
};

/// The derivative of a primal value. In a tangent it has the same kind; in an adjoint fields stay fields, a parameter
/// becomes a sum and a sum a parameter. The weights of a network are a parameter.
struct Link {
  enum class Kind { field, param, sum };
  Kind kind = Kind::field;  // of the primal
  std::string primal, derived;
};

struct Derivative {
  stencil::Module module;   // holds `program` and every kernel it runs
  std::string program;      // NAME_tangent or NAME_adjoint
  std::vector<Link> links;  // of all values that vary; every active input has one
  bool is_adjoint = false;

  /// Name of the derivative of `primal`; nullptr if it does not vary.
  const std::string* derived(Link::Kind kind, const std::string& primal) const;
  const std::string* field(const std::string& primal) const { return derived(Link::Kind::field, primal); }
  const std::string* param(const std::string& primal) const { return derived(Link::Kind::param, primal); }
  const std::string* sum(const std::string& primal) const { return derived(Link::Kind::sum, primal); }
};

/// NAME_tangent: for inputs x and directions x_dot computes all results of NAME and their directional derivatives.
///
/// New inputs: x_dot of each active field, p_dot (a parameter) of each active parameter. New results: y_dot of each
/// result field (in `swaps` and `keeps` together with y), s_dot of each sum.
Derivative tangent(const stencil::Module& module, const std::string& program, const Activity& wrt,
                   DiagnosticSink& sink);

/// NAME_adjoint: for inputs x and seeds y_bar computes x_bar = (dy/dx)^T y_bar.
///
/// Inputs: what NAME reads, y_bar of each result field, s_bar (a parameter) of each sum. Results: x_bar of each active
/// field (through swap y_bar, x_bar where NAME swaps x, y; else through keep), the sum p_bar of each active parameter.
/// Intermediate fields are recomputed from the inputs if the derivative reads them.
/// Custom adjoints (Kernel::custom_adjoints) replace derived formulas, after a check against the tangent.
/// Gather form: x_bar[i] = sum over reads k of (df/dx_k * y_bar) at the point i - k. Along bounded axes the kernel runs
/// on the region extended by the stencil radius, terms of points outside are masked, and `fold` transposes the halo
/// fill.
Derivative adjoint(const stencil::Module& module, const std::string& program, const Activity& wrt, DiagnosticSink& sink,
                   const Surroundings& surroundings = {});

/// NAME_squares, for a program whose sums are sums of squares c*r^2 (c does not vary): the tangent of NAME, but with
/// s_dot = the sum of c*r_dot^2. The gradient of s_dot by the directions is the Gauss-Newton Hessian of s times the
/// directions. nullopt for other sums.
std::optional<Derivative> squares_of_tangent(const stencil::Module& module, const std::string& program,
                                             const Activity& wrt, DiagnosticSink& sink);

}  // namespace dpde::adjoint
