// SPDX-License-Identifier: Apache-2.0
#include "driver/compile/stencil_exceeds_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "model/boundary/metric.h"
#include "stencil/analyse/effects.h"
#include "stencil/build.h"
#include "stencil/passes/displaced_values.h"
#include "stencil/walk.h"

namespace dpde::driver {

using namespace stencil;

namespace {

/// Number of adjacent cells of a field that a formula reads.
struct Reach {
  int cells = 1;
  SourceRange where;
};
using Reaches = std::array<Reach, max_rank>;
struct Offsets {
  Offset least{}, most{};
};

void look_at(const Kernel& kernel, Reaches& farthest) {
  const SourceRange where = kernel.stores.empty() ? SourceRange{} : kernel.stores.front().origin.range;
  std::map<std::string, Offsets> reads;
  const auto note = [&](const Expr& part) {
    const auto* access = as<Access>(part);
    if (access == nullptr) return;
    Offsets& of_field = reads[access->field];
    for (std::size_t axis = 0; axis < farthest.size(); ++axis) {
      of_field.least[axis] = std::min(of_field.least[axis], access->offset[axis]);
      of_field.most[axis] = std::max(of_field.most[axis], access->offset[axis]);
    }
  };
  visit(kernel, note);
  for (const auto& [field, offsets] : reads) {
    for (std::size_t axis = 0; axis < farthest.size(); ++axis) {
      const int cells = offsets.most[axis] - offsets.least[axis] + 1;
      if (cells > farthest[axis].cells) farthest[axis] = {cells, where};
    }
  }
}

}  // namespace

void tell_wide_formulas(const Module& module, const Program& program, const model::Problem& problem,
                        DiagnosticSink& sink) {
  Reaches farthest;
  const Module whole = with_values_in_place(module);
  for_each_kind<Run>(whole.find_program(program.name)->body,
                     [&](const Run& run) { look_at(kernel_of(whole, run), farthest); });
  for (std::size_t a = 0; a < problem.axes.size(); ++a) {
    const model::Axis& axis = problem.axes[a];
    const int points = farthest[a].cells;
    const bool is_periodic = axis.topology == Topology::periodic;
    if (points <= 3 || points <= axis.cells || (is_periodic && axis.cells == 1)) continue;
    sink.report(
        "formula-wider-than-grid", farthest[a].where,
        {fmt::format("{}", points), model::name_of_axis(problem, a), fmt::format("{}", axis.cells)},
        fmt::format("--set cells.{}={} has room for it; schemes of lower order reach less far", axis.name, points));
  }
}

}  // namespace dpde::driver
