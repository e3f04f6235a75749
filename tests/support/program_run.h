// SPDX-License-Identifier: Apache-2.0
// One stencil program run by the reference interpreter, and by the runtime's executor on compiled code: the same
// inputs, the same results under the same names. All memory starts as NaN, so that what nobody wrote shows.
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

using FieldValues = std::map<std::string, std::vector<double>>;  // interiors, x fastest

struct Outcome {
  FieldValues fields;  // swapped states and kept fields
  std::map<std::string, double> sums;
};

struct RunInputs {
  stencil::Grid grid;
  FieldValues fields;  // every input but the coordinates, which run from 0 with a spacing of 0.3
  stencil::Params params;
  int steps = 1;
  Precision real = Precision::f64;  // of the interpreter; compiled code knows its own
};

Outcome run_interpreted(const stencil::Module& module, const stencil::Program& program, const RunInputs& inputs);
/// `compiled` is `program` in machine code. `is_over`: states and their next values that may have the same memory do.
Outcome run_executed(const dpde_program& compiled, const stencil::Program& program, const RunInputs& inputs,
                     int threads, bool is_over = false);
/// Whether there are such.
bool writes_over_states(const dpde_program& compiled);
/// The same where the grid is divided among ranks in threads, so many along each axis.
/// @throws Error where they cannot run it.
Outcome run_divided(const dpde_program& compiled, const stencil::Program& program, const RunInputs& inputs,
                    const std::array<int64_t, 3>& ranks);
/// Whether values of several ranks are added up for a field: in another order than on the whole grid.
bool adds_up_fields(const dpde_program& compiled);

}  // namespace dpde::testing
