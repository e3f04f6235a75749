// SPDX-License-Identifier: Apache-2.0
#include "stencil/effects.h"

#include <algorithm>

#include "stencil/build.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

using NameList = std::vector<std::string>;

void add_new(NameList& names, const std::string& name) {
  if (std::ranges::find(names, name) == names.end()) names.push_back(name);
}

NameList params_of(const std::vector<AxisBoundary>& axes) {
  NameList params;
  for_each_side_value(axes, [&](const Expr& value) {
    visit(value, [&](const Expr& e) {
      if (const Param* p = std::get_if<Param>(&e->kind)) add_new(params, p->name);
    });
  });
  return params;
}

Effects of_fill(const Fill& fill) {
  Effects e{.reads = {fill.field}, .fills = {fill.field}, .params = params_of(fill.axes)};
  for (const std::string& wall : wall_fields(fill.axes)) add_new(e.reads, wall);
  return e;
}

/// It adds the halo to the cells, and to the fields of the walls.
Effects of_fold(const Fold& fold) {
  std::set<std::string> folded = wall_fields(fold.axes);
  folded.insert(fold.field);
  const NameList names(folded.begin(), folded.end());
  return {.reads = names, .updates = names, .params = params_of(fold.axes)};
}

Effects of_infer(const Infer& infer) {
  return {.reads = fields_read(infer), .writes = fields_written(infer), .networks = {infer.network}};
}

Effects of_run(const Kernel& kernel) {
  Signature s = signature(kernel);
  Effects e{.writes = std::move(s.writes),
            .updates = std::move(s.updates),
            .params = std::move(s.params),
            .sums = std::move(s.sums),
            .kernels = {kernel.name}};
  for (const Signature::Read& read : s.reads) e.reads.push_back(read.field);
  return e;
}

}  // namespace

Effects effects(const Module& module, const Statement& statement) {
  return match(
      statement, [](const Fill& fill) { return of_fill(fill); }, [](const Fold& fold) { return of_fold(fold); },
      [](const Reduce& reduce) { return Effects{.reads = {reduce.field}, .writes = {reduce.result}}; },
      [](const Infer& infer) { return of_infer(infer); },
      [&](const Run& run) { return of_run(kernel_of(module, run)); });
}

std::vector<const Kernel*> kernels_run(const Module& module, const Program& program) {
  std::vector<const Kernel*> kernels;
  for_each_run(program, [&](const Run& run) {
    const Kernel* kernel = &kernel_of(module, run);
    if (std::ranges::find(kernels, kernel) == kernels.end()) kernels.push_back(kernel);
  });
  return kernels;
}

Parts parts_of(const std::vector<Program>& programs) {
  Parts parts;
  for (const Program& program : programs) {
    for (const Statement& statement : program.body) {
      match(
          statement, [](const Fill&) {}, [](const Fold&) {}, [](const Reduce&) {},
          [&](const Infer& infer) { add_new(parts.networks, infer.network); },
          [&](const Run& run) { parts.kernels.insert(run.kernel); });
    }
  }
  return parts;
}

}  // namespace dpde::stencil
