// SPDX-License-Identifier: Apache-2.0
#include "driver/wide_formulas.h"

#include <fmt/format.h>

#include "stencil/build.h"
#include "stencil/effects.h"
#include "support/match.h"

namespace dpde::driver {

using namespace stencil;

namespace {

struct Reach {
  int cells = 0;
  SourceRange where;
};
using Reaches = std::array<Reach, max_rank>;

void look_at(const Kernel& kernel, Reaches& farthest) {
  const SourceRange where = kernel.stores.empty() ? SourceRange{} : kernel.stores.front().origin.range;
  for (const Signature::Read& read : signature(kernel).reads) {
    for (std::size_t axis = 0; axis < farthest.size(); ++axis) {
      if (read.halo[axis] > farthest[axis].cells) farthest[axis] = {read.halo[axis], where};
    }
  }
}

void look_at(const Module& module, const std::vector<Statement>& body, Reaches& farthest) {
  for (const Statement& statement : body) {
    match(
        statement, [](const Fill&) {}, [](const Fold&) {}, [](const Reduce&) {}, [](const NetworkCall&) {},
        [](const Transform&) {}, [&](const Run& run) { look_at(kernel_of(module, run), farthest); },
        [&](const Solve& solve) { look_at(module, solve.body, farthest); },
        [&](const Repeat& repeat) { look_at(module, repeat.body, farthest); });
  }
}

}  // namespace

void tell_wide_formulas(const Module& module, const Program& program, const model::Problem& problem,
                        DiagnosticSink& sink) {
  Reaches farthest;
  look_at(module, program.body, farthest);
  for (std::size_t a = 0; a < problem.axes.size(); ++a) {
    const model::Axis& axis = problem.axes[a];
    const int points = 2 * farthest[a].cells + 1;
    const bool is_periodic = axis.topology == Topology::periodic;
    if (points <= 3 || points <= axis.cells || (is_periodic && axis.cells == 1)) continue;
    sink.report(
        "formula-wider-than-grid", farthest[a].where,
        {fmt::format("{}", points), axis.name, fmt::format("{}", axis.cells)},
        fmt::format("--set cells.{}={} has room for it; schemes of lower order reach less far", axis.name, points));
  }
}

}  // namespace dpde::driver
