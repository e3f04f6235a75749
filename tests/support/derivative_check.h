// SPDX-License-Identifier: Apache-2.0
// Checks of derived programs with the reference interpreter: tangent against central differences, adjoint against
// tangent.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>

#include "adjoint/adjoint.h"
#include "stencil/interpret/interpret.h"
#include "stencil/stencil.h"

namespace dpde::testing {

/// Parses kernels and programs; any diagnostic or verifier message fails the running test.
stencil::Module parse_module(const std::string& text);

struct Check {
  double dot_product = 0;        // | <w, J d> - <J^T w, d> | / (sum of the magnitudes of all products)
  double finite_difference = 0;  // largest |J d - central difference| relative to the largest |J d| (or 0.1)
  double bend = 0;               // difference of the one-sided differences, likewise: large if a kink is crossed
  double spread = INFINITY;      // smallest difference of central differences by two steps: large if none is accurate
  double change = 0;             // of J d over the smallest step, likewise: large if no step resolves the function
  double forward = 0, reverse = 0;  // <w, J d> and <J^T w, d>
  double magnitude = 0;             // |<w, J d>|: a comparison of zeros checks nothing
};
struct Derivatives {
  adjoint::Derivative tangent, adjoint;
};

/// Random inputs in [0.5, 1.5], directions and seeds in [-1, 1], params in [0.2, 0.8], all from `seed`.
Check check_derivatives(const stencil::Module& module, const std::string& program, const adjoint::Activity& wrt,
                        const stencil::Grid& grid, std::uint64_t seed);

/// The same with given derivatives, and without test failures of its own.
Check check_derivatives(const stencil::Module& module, const std::string& program, const Derivatives& derived,
                        const adjoint::Activity& wrt, const stencil::Grid& grid, std::uint64_t seed);

}  // namespace dpde::testing
