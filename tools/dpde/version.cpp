// SPDX-License-Identifier: Apache-2.0
#include "version.h"

#include <fmt/format.h>

#include "command.h"
#include "commit.h"  // made by the build
#include "dpde/instruction_set.h"
#include "driver/memory/machine_speed.h"

namespace dpde::tools {

std::string version_text() {
  return fmt::format("{}\ncommit {}\nLLVM {}\nprocessor {}, {}", version, DPDE_COMMIT, DPDE_LLVM_VERSION,
                     driver::machine_name(), word_of(instruction_set()));
}

}  // namespace dpde::tools
