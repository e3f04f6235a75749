// SPDX-License-Identifier: Apache-2.0
// A program and its derivatives in one module, their inputs, and the difference between two outcomes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "random/random_program.h"
#include "support/derivative_check.h"
#include "support/program_run.h"

namespace dpde::testing {

struct Variants {
  stencil::Module module;
  std::vector<std::string> programs;
};

/// Adds a program and the kernels that are not there yet.
void add_to(Variants& variants, const stencil::Module& module, const std::string& program);

/// Fields between 0.5 and 1.5, params between 0.2 and 0.8, spacings around 1; two steps, as the halo of a swapped state
/// is filled between.
RunInputs inputs_for(const stencil::Module& module, const std::string& program, const stencil::Grid& grid,
                     std::uint64_t seed);

/// The largest value, or 1.
double largest(const Outcome& outcome);

/// The largest difference relative to the largest value of both (or 1); infinite where a value is missing or not a
/// number. At most 2 otherwise, whichever is `got`: where rounding leaves no digit, as of products of many slopes of
/// the sine of large values, results differ by powers of ten, and none of them is the right one.
double distance(const Outcome& got, const Outcome& wanted);

/// The module from which code is generated, with or without all passes.
stencil::Module lowered(stencil::Module module, bool with_passes);

/// Whether `error`, of another order of the operations of `program`, may be rounding: below 1e-11, or ten times what
/// with_rounding() makes of it. Products of what two steps have made grow to some millions, and a sine of that has as
/// many times the rounding of its argument.
bool is_rounding(double error, const stencil::Module& module, const std::string& program, const stencil::Grid& grid,
                 std::uint64_t seed);

}  // namespace dpde::testing
