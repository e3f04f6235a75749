// SPDX-License-Identifier: Apache-2.0
// A program with explicit fills, converted to the form with halo rules.
#pragma once

#include <utility>
#include <vector>

#include "stencil/passes/place_fills.h"
#include "support/contains.h"
#include "support/match.h"

namespace dpde::testing {

/// Removes the fills from the statements, also within blocks, and returns the rule of each field's first fill.
inline std::vector<stencil::HaloRule> take_fills(std::vector<stencil::Statement>& body) {
  using namespace stencil;
  std::vector<HaloRule> halos;
  std::vector<Statement> kept;
  for (Statement& statement : body) {
    const auto keep = [&](auto& same) { kept.emplace_back(same); };
    match(
        statement,
        [&](Fill& fill) {
          if (!has_rule(halos, fill.field)) halos.push_back(rule_of_fill(fill));
        },
        [&](Fold& fold) { keep(fold); }, [&](Reduce& reduce) { keep(reduce); }, [&](NetworkCall& call) { keep(call); },
        [&](Transform& transform) { keep(transform); }, [&](Run& run) { keep(run); },
        [&](Solve& solve) {
          solve.halos = take_fills(solve.body);
          keep(solve);
        },
        [&](Repeat& repeat) {
          repeat.halos = take_fills(repeat.body);
          keep(repeat);
        });
  }
  body = std::move(kept);
  return halos;
}

/// No fills remain; each field has the rule of its first fill. Results that were filled on walls need that.
inline stencil::Module with_rules(stencil::Module module) {
  using namespace stencil;
  for (Program& program : module.programs) {
    std::vector<std::string> results = program.keeps;
    for (const Swap& swap : program.swaps) results.push_back(swap.next);
    program.halos = take_fills(program.body);
    for (HaloRule& rule : program.halos) {
      if (rule.need == FillNeed::reads && contains(results, rule.fill.field)) rule.need = FillNeed::results;
    }
  }
  return module;
}

}  // namespace dpde::testing
