// SPDX-License-Identifier: Apache-2.0
// Links between derivative values and their primal values, for the runtime and the driver. Only adjoint/ makes the
// names of derivative values.
#pragma once

#include <string>
#include <vector>

#include "codegen/program_table.h"
#include "driver/compile/pipeline.h"

namespace dpde::driver {

/// A derivative program and its links, in the format of its program table.
struct LinkedProgram {
  std::string program;
  std::vector<codegen::TableLink> links;
};
/// The links of all derivatives.
std::vector<LinkedProgram> linked_programs(const Compiled& compiled);

}  // namespace dpde::driver
