// SPDX-License-Identifier: Apache-2.0
#include "random/torn_corners.h"

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "stencil/build.h"
#include "stencil/walk.h"

namespace dpde::testing {

using namespace stencil;

namespace {

bool is_constant(const Side& side) { return wall_field(side) == nullptr; }
bool keeps_constants(const Side& side) { return condition_of(side.kind).keeps_constants(); }
bool is_zero(const Side& side) { return is_literal(side.value, 0); }

/// Whether the fills of the two sides commute: each one continues linearly, with weights that are the same all along
/// the wall, and maps the inhomogeneous part of the other one, a constant, to itself.
bool commute(const Side& one, const Side& other) {
  const auto is_kept = [](const Side& side, const Side& by) {
    return is_zero(side) || (is_constant(side) && keeps_constants(by));
  };
  return is_kept(one, other) && is_kept(other, one);
}

bool commute(const AxisBoundary& x, const AxisBoundary& y) {
  if (x.topology == Topology::periodic || y.topology == Topology::periodic) return true;
  return commute(x.low, y.low) && commute(x.low, y.high) && commute(x.high, y.low) && commute(x.high, y.high);
}

/// Whether a run of the kernel reads a corner of the field; values on walls are read beside them.
bool reads_corner(const Kernel& kernel, int grow, const std::string& field, bool on_x_walls, bool on_y_walls) {
  return any_part(kernel, [&](const Expr& e) {
    if (const Interp* interp = as<Interp>(e)) return interp->field == field;
    const Access* access = as<Access>(e);
    if (access == nullptr || access->field != field) return false;
    const bool is_beyond_x = access->offset[0] != 0 || grow > 0 || on_x_walls,
               is_beyond_y = access->offset[1] != 0 || grow > 0 || on_y_walls;
    return is_beyond_x && is_beyond_y;
  });
}

}  // namespace

bool has_torn_corners(const Module& module) {
  bool result = false;
  for (const Program& program : module.programs) {
    if (program.axes.size() < 2) continue;
    for_each_kind<Fill>(program.body, [&](const Fill& fill) {
      if (commute(fill.axes[0], fill.axes[1])) return;
      for_each_kind<Run>(program.body, [&](const Run& run) {
        result |= reads_corner(*module.find_kernel(run.kernel), run.grow, fill.field, is_on_walls(fill.axes[0]),
                               is_on_walls(fill.axes[1]));
      });
    });
  }
  return result;
}

}  // namespace dpde::testing
