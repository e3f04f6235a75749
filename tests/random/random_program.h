// SPDX-License-Identifier: Apache-2.0
// Random well-typed stencil programs. They obey all rules of stencil.h and of the verifier and keep functions in their
// domains, so that on inputs of order one all values are finite. So each failure is a fault of the compiler.
#pragma once

#include <cstdint>
#include <string>

#include "adjoint/adjoint.h"
#include "stencil/interpret/interpret.h"
#include "stencil/stencil.h"

namespace dpde::testing {

struct RandomProgram {
  std::uint64_t seed = 0;  // of the inputs too
  stencil::Module module;  // program `p`
  adjoint::Activity wrt;
  stencil::Grid grid;
  bool has_wrong_adjoint = false;  // among those given with kernels
};

/// A program; the same for the same seed on all machines.
RandomProgram random_program(std::uint64_t seed);

/// Kernels and program as text, with the variables of differentiation and the grid as comments.
std::string describe(const RandomProgram& program);

}  // namespace dpde::testing
