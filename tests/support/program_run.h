// SPDX-License-Identifier: Apache-2.0
// Runs a stencil program in the reference interpreter, and as compiled code in the runtime's executor: same inputs,
// same names of results. All memory starts as NaN, so that unwritten values are detected.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "dpde/kernel_abi.h"
#include "stencil/interpret/interpret.h"
#include "stencil/stencil.h"

namespace dpde::testing {

using FieldValues = std::map<std::string, std::vector<double>>;  // interior cells, x fastest

struct Outcome {
  FieldValues fields;  // swapped states and other results
  std::map<std::string, double> sums;
};

struct RunInputs {
  stencil::Grid grid;
  FieldValues fields;  // all inputs except the coordinates, which start at 0 with spacing 0.3
  stencil::Params params;
  int steps = 1;
  Precision real = Precision::f64;  // for the interpreter; compiled code has its own
};

Outcome run_interpreted(const stencil::Module& module, const stencil::Program& program, const RunInputs& inputs);
/// `compiled` is the machine code of `program`. `is_over`: states share memory with their next values if possible.
Outcome run_executed(const dpde_program& compiled, const stencil::Program& program, const RunInputs& inputs,
                     int threads, bool is_over = false);
/// Whether some state shares memory with its next value.
bool writes_over_states(const dpde_program& compiled);
/// The same on a grid divided among ranks in threads, with this number along each axis.
/// @throws Error where they cannot run it.
Outcome run_divided(const dpde_program& compiled, const stencil::Program& program, const RunInputs& inputs,
                    const std::array<int64_t, 3>& ranks);
/// Whether a field is a sum over several ranks, in a different order than on the whole grid.
bool adds_up_fields(const dpde_program& compiled);

}  // namespace dpde::testing
