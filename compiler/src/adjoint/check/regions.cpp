// SPDX-License-Identifier: Apache-2.0
#include "adjoint/check/regions.h"

#include <algorithm>

#include "stencil/analyse/effects.h"
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
  for_each_run(program, [&](const Run& run) {
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
    match(
        statement, [&](const Fill& fill) { fills[fill.field] = &fill; }, [](const Fold&) {}, [](const Reduce&) {},
        [](const NetworkCall&) {}, [](const Transform&) {}, [](const Run&) {}, [](const Solve&) {},
        [](const Repeat&) {});
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
        [&](const Reduce& reduce) { read.insert(reduce.field); },
        [&](const NetworkCall& network_call) {
          for (const std::string& field : fields_read(network_call)) read.insert(field);
        },
        [&](const Transform& transform) {
          for (const Transform::Term& term : transform.terms) read.insert(term.field);
        },
        [&](const Run& run) {
          const Kernel& kernel = *module.find_kernel(run.kernel);
          for (const auto& one : signature(kernel).reads) read.insert(one.field);
          for (const Scatter& scatter : kernel.scatters) read.insert(scatter.target.field);
        },
        [&](const Solve& solve) {
          for (const std::string& field : effects(module, solve).reads) read.insert(field);
        },
        [&](const Repeat& repeat) {
          for (const std::string& field : effects(module, repeat).reads) read.insert(field);
        });
  }
  return read;
}

bool is_read_by(const Module& kernels, const std::vector<Statement>& body, const std::string& field) {
  return std::ranges::any_of(body, [&](const Statement& statement) {
    const auto is_read = [&] { return contains(effects(kernels, statement).reads, field); };
    return match(
        statement, [&](const Fill& fill) { return wall_fields(fill.axes).contains(field); },
        [&](const Fold& fold) { return wall_fields(fold.axes).contains(field); },
        [&](const Reduce&) { return is_read(); }, [&](const NetworkCall&) { return is_read(); },
        [&](const Transform&) { return is_read(); }, [&](const Run&) { return is_read(); },
        [&](const Solve&) { return is_read(); }, [&](const Repeat&) { return is_read(); });
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
  for_each_run(program, [&](const Run& run) {
    if (run.grow == 0) return;
    const Signature s = signature(*module.find_kernel(run.kernel));
    fields.insert(s.writes.begin(), s.writes.end());
  });
  return fields;
}

}  // namespace dpde::adjoint
