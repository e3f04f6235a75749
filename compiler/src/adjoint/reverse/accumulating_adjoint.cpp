// SPDX-License-Identifier: Apache-2.0
#include "adjoint/reverse/accumulating_adjoint.h"

#include <algorithm>
#include <set>
#include <utility>

#include "stencil/analyse/effects.h"
#include "stencil/walk.h"
#include "support/contains.h"
#include "support/match.h"

namespace dpde::adjoint {

namespace {

using stencil::Module;
using stencil::Program;

/// Whether the first statement that uses the field is a kernel that stores it, and later kernels at most add to it.
bool is_stored_once(const Module& module, const Program& program, const std::string& field) {
  bool is_stored = false;
  for (const stencil::Statement& statement : program.body) {
    const stencil::Effects e = stencil::effects(module, statement);
    const bool writes = contains(e.writes, field);
    const bool uses = contains(e.reads, field) || contains(e.fills, field) || contains(e.block_locals, field) ||
                      contains(e.invalidates_halo, field);
    if (!writes && !uses && !contains(e.updates, field)) continue;
    const bool is_row_wise = match(
        statement,
        [&](const stencil::Run& run) {
          const stencil::Kernel& kernel = stencil::kernel_of(module, run);
          return std::ranges::none_of(kernel.scatters,
                                      [&](const stencil::Scatter& s) { return s.target.field == field; });
        },
        always<false, stencil::Fill, stencil::Fold, stencil::Reduce, stencil::NetworkCall, stencil::Transform,
               stencil::Solve, stencil::Repeat>);
    if (uses || !is_row_wise || writes == is_stored) return false;
    is_stored = true;
  }
  return is_stored;
}

/// Turns suitable results into inputs to which the program adds; false, and changes nothing, if there are none.
bool add_to_totals(Program& program, const std::vector<std::string>& results, Module& module) {
  std::set<std::string> added_to;
  for (const std::string& result : results) {
    if (contains(program.keeps, result) && is_stored_once(module, program, result)) added_to.insert(result);
  }
  for_each_kind<stencil::Run>(program.body, [&](stencil::Run& run) {
    const auto is_first = [&](const stencil::Store& s) { return !s.accumulate && added_to.contains(s.field); };
    if (std::ranges::none_of(stencil::kernel_of(module, run).stores, is_first)) return;
    stencil::Kernel kernel = stencil::kernel_of(module, run);
    for (stencil::Store& store : kernel.stores) store.accumulate = store.accumulate || is_first(store);
    run.kernel = add_kernel(module, std::move(kernel), "_accumulating");
  });
  return !added_to.empty();
}

}  // namespace

std::string add_kernel(Module& module, stencil::Kernel kernel, const std::string& suffix) {
  do kernel.name += suffix;
  while (module.find_kernel(kernel.name) != nullptr);
  module.kernels.push_back(std::move(kernel));
  return module.kernels.back().name;
}

std::optional<std::string> add_accumulating(const std::string& name, const std::vector<std::string>& results,
                                            Module& module) {
  const Program* program = module.find_program(name);
  std::string added_name = name + "_accumulating";
  if (program == nullptr || module.find_program(added_name) != nullptr) return std::nullopt;
  Program added = *program;
  added.name = added_name;
  if (!add_to_totals(added, results, module)) return std::nullopt;
  module.programs.push_back(std::move(added));
  return added_name;
}

void accumulate(const std::string& name, const std::vector<std::string>& results, Module& module) {
  const auto program = std::ranges::find(module.programs, name, &Program::name);
  if (program != module.programs.end()) add_to_totals(*program, results, module);
}

}  // namespace dpde::adjoint
