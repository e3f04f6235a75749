// SPDX-License-Identifier: Apache-2.0
#include "stability/step_capabilities.h"

#include <algorithm>

#include "stability/waves/coupled_waves.h"
#include "stencil/analyse/effects.h"
#include "stencil/build.h"
#include "stencil/walk.h"
#include "support/match.h"

namespace dpde::stability {

using namespace stencil;

Module without_guesses(Module module) {
  for (Program& program : module.programs) forget_guesses(program.body);
  return module;
}

void survey(const Module& module, const std::vector<Statement>& body, StepCapabilities& result) {
  const auto look_at = [&](const Statement& statement) {
    match(
        statement, ignored<Fill>, [&](const Fold&) { result.why = "it folds halos"; },
        [&](const Reduce&) { result.reduces = true; }, [&](const NetworkCall&) { result.has_networks = true; },
        [&](const Transform& transform) {
          const auto solves = [](const Transform::Term& t) {
            return t.by.function.kind == WaveFunction::Kind::inverse;
          };
          result.solves = result.solves || std::ranges::any_of(transform.terms, solves);
        },
        [&](const Run& run) {
          const Kernel& kernel = kernel_of(module, run);
          if (!kernel.scatters.empty()) result.why = "it scatters";
          for (const Let& let : kernel.lets)
            result.is_semi_lagrangian = result.is_semi_lagrangian || holds_any<Interp>(let.value);
          for (const Store& s : kernel.stores)
            result.is_semi_lagrangian = result.is_semi_lagrangian || holds_any<Interp>(s.value);
        },
        [&](const Solve& solve) {
          result.solves = true;
          const auto is_run = [](const Statement& s) { return is_one_of<Fill, Run>(s); };
          if (solve.unknowns.size() > most_coupled) result.why = "a solve for many fields at once is in it";
          if (!std::ranges::all_of(solve.body, is_run)) result.why = "a solve of more than kernels is in it";
        },
        [&](const Repeat& repeat) {
          if (!repeat.saves.empty() || !repeat.loads.empty()) result.why = "it keeps stacks";
        });
  };
  for_each_statement(body, look_at, Blocks::passes);
}

}  // namespace dpde::stability
