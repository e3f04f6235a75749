// SPDX-License-Identifier: Apache-2.0
#include "optimise/fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <span>

#include "dpde/runtime/error.h"
#include "dpde/runtime/layout.h"
#include "grid/halo_axis.h"

namespace dpde {
namespace {

using ReportOfFit = std::function<void(const std::string& what)>;

bool has_pole(const dpde_fill& fill) {
  return std::ranges::any_of(fill.axes,
                             [](const dpde_boundary& sides) { return is_pole(sides.low) || is_pole(sides.high); });
}

/// Refuses operations that read cells anywhere in the grid.
void check_operations(const dpde_operation* operations, int count, const ReportOfFit& fail) {
  for (const dpde_operation& operation : std::span(operations, static_cast<size_t>(count))) {
    if (std::any_of(operation.then, operation.then + operation.then_count, has_pole)) fail("poles");
    switch (operation.kind) {
      case DPDE_FILL:
      case DPDE_FOLD:
        if (has_pole(operation.fill)) fail("poles");
        break;
      case DPDE_SWEEP:
      case DPDE_REDUCE: break;
      case DPDE_NETWORK: fail("networks"); break;
      case DPDE_TRANSFORM: fail("transforms"); break;
      case DPDE_SOLVE: fail("solves"); break;
      case DPDE_REPEAT: check_operations(operation.repeat.operations, operation.repeat.operation_count, fail); break;
      default: fail(fmt::format("operations of kind {}", operation.kind));
    }
  }
}

void check_can_be_divided(const dpde_program& program, const ReportOfFit& fail) {
  if (program.interpret != nullptr) fail("the interpreter");
  if (std::any_of(program.prepare, program.prepare + program.prepare_count, has_pole)) fail("poles");
  check_operations(program.operations, program.operation_count, fail);
}

}  // namespace

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
  if (!is_divided(layout)) return;
  check_can_be_divided(
      program, [&](const std::string& what) { fail("a grid that is divided among ranks cannot have " + what); });
}

}  // namespace dpde
