// SPDX-License-Identifier: Apache-2.0
#include "run/bound_program.h"

#include <fmt/format.h>

#include "dpde/runtime/error.h"

namespace dpde {

void throw_not_bound(const dpde_program& program, std::string_view what, std::string_view name) {
  throw Error(ErrorKind::run, fmt::format("program {}: {} {} is not bound", program.name, what, name));
}

}  // namespace dpde
