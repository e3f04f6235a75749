// SPDX-License-Identifier: Apache-2.0
#include "fit.h"

#include <fmt/format.h>

#include "dpde/runtime/error.h"

namespace dpde {

void check_fits(const dpde_program& program, const dpde_layout& layout) {
  const auto fail = [&](const std::string& what) {
    throw Error(ErrorKind::run, fmt::format("program {}: {}", program.name, what));
  };
  if (program.version != DPDE_ABI_VERSION)
    fail(fmt::format("made for version {} of the runtime's tables, this is {}", program.version, DPDE_ABI_VERSION));
  if (program.real != layout.real) fail("its values and the grid's are not of the same precision");
  if (program.rank != layout.rank) fail(fmt::format("has {} axes, the grid has {}", program.rank, layout.rank));
  for (int axis = 0; axis < program.rank; ++axis) {
    if (program.halo[axis] > layout.halo[axis]) {
      fail(fmt::format("needs a halo of {} cells along {}, the grid has {}", program.halo[axis], "xyz"[axis],
                       layout.halo[axis]));
    }
  }
}

}  // namespace dpde
