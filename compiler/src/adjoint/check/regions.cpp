// SPDX-License-Identifier: Apache-2.0
#include "adjoint/check/regions.h"

#include <algorithm>

#include "stencil/analyse/effects.h"
#include "stencil/walk.h"
#include "support/contains.h"
#include "support/match.h"

namespace dpde::adjoint {

using namespace stencil;

bool has_bounded_axis(const std::vector<Topology>& axes) {
  return std::find(axes.begin(), axes.end(), Topology::bounded) != axes.end();
}

int reach(const Module& module, const Program& program, const Varied& varied) {
  if (!has_bounded_axis(program.axes)) return 0;
  int result = 0;
  for_each_kind<Run>(program.body, [&](const Run& run) {
    const Kernel& kernel = *module.find_kernel(run.kernel);
    for (const Scatter& scatter : kernel.scatters) {
      if (varied.fields.contains(scatter.target.field))
        result = std::max(result, reach_of(scatter.target, program.axes));
    }
    for (const auto& read : signature(kernel).reads) {
      if (!varied.fields.contains(read.field)) continue;
      int width = 0;
      for (size_t axis = 0; axis < program.axes.size(); ++axis) {
        if (program.axes[axis] == Topology::bounded) width = std::max(width, read.halo[axis]);
      }
      result = std::max(result, run.grow + width);
    }
  });
  return result;
}

std::map<std::string, const Fill*> fills_at_the_end(const Module& module, const Program& program) {
  std::map<std::string, const Fill*> fills;
  for (const Statement& statement : program.body) {
    const Effects e = effects(module, statement);
    for (const auto* changed : {&e.writes, &e.updates}) {
      for (const std::string& field : *changed) fills.erase(field);
    }
    match_some(statement, [&](const Fill& fill) { fills[fill.field] = &fill; });
  }
  return fills;
}

std::set<std::string> fields_read_inside(const Module& module, const Program& program) {
  std::set<std::string> read;
  for (const Statement& statement : program.body) {
    match(
        statement,
        [&](const Fill& fill) {
          read.merge(wall_fields(fill.axes));
          if (is_on_walls(fill.axes)) read.insert(fill.field);
        },
        [&](const Fold& fold) {
          read.merge(wall_fields(fold.axes));
          read.insert(fold.field);
        },
        [&](const Run& run) {
          const Kernel& kernel = *module.find_kernel(run.kernel);
          for (const auto& one : signature(kernel).reads) read.insert(one.field);
          for (const Scatter& scatter : kernel.scatters) read.insert(scatter.target.field);
        },
        [&](const OneOf<Reduce, NetworkCall, Transform, Solve, Repeat> auto& other) {
          for (const std::string& field : effects(module, other).reads) read.insert(field);
        });
  }
  return read;
}

bool is_read_by(const Module& kernels, const std::vector<Statement>& body, const std::string& field) {
  return std::ranges::any_of(body, [&](const Statement& statement) {
    const auto is_read = [&] { return contains(effects(kernels, statement).reads, field); };
    return match(
        statement, [&](const OneOf<Fill, Fold> auto& halo) { return wall_fields(halo.axes).contains(field); },
        [&](const OneOf<Reduce, NetworkCall, Transform, Run, Solve, Repeat> auto&) { return is_read(); });
  });
}

std::vector<AxisBoundary> boundary_around(const std::vector<Topology>& axes) {
  std::vector<AxisBoundary> boundary;
  for (const Topology topology : axes)
    boundary.push_back({topology, {SideKind::zero_gradient, 0.0}, {SideKind::zero_gradient, 0.0}});
  return boundary;
}

std::set<std::string> grown_fields(const Module& module, const Program& program) {
  std::set<std::string> fields;
  if (!has_bounded_axis(program.axes)) return fields;
  for_each_kind<Run>(program.body, [&](const Run& run) {
    if (run.grow == 0) return;
    const Signature s = signature(*module.find_kernel(run.kernel));
    fields.insert(s.writes.begin(), s.writes.end());
  });
  return fields;
}

}  // namespace dpde::adjoint
