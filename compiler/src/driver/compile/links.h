// SPDX-License-Identifier: Apache-2.0
// What derivatives say of what their values belong to, as the runtime and the driver want it. Names of derived values
// are made in adjoint/ and nowhere else.
#pragma once

#include <string>
#include <vector>

#include "codegen/program_table.h"
#include "driver/compile/pipeline.h"

namespace dpde::driver {

/// A derivative and its links, as they stand in the table of its program.
struct LinkedProgram {
  std::string program;
  std::vector<codegen::TableLink> links;
};
/// Those of all derivatives.
std::vector<LinkedProgram> linked_programs(const Compiled& compiled);

}  // namespace dpde::driver
