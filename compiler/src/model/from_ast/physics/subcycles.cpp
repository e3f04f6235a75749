// SPDX-License-Identifier: Apache-2.0
// subcycle c in 4: equations with several substeps in each step of the others.
#include <fmt/format.h>

#include <cmath>

#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"
#include "model/print/print_model.h"

namespace dpde::model {

namespace {

constexpr int most_parts = 1'000'000;  // substeps cost time, not code: more are a typing error

int parts_of(Elaboration& elaboration, const ast::Expr& written) {
  const auto parts = evaluate(elaboration, written, "the number of substeps");
  if (!parts) return 1;
  if (*parts >= 1 && *parts <= most_parts && *parts == std::floor(*parts)) return static_cast<int>(*parts);
  elaboration.sink.report("bad-subcycles", written.range(), {fmt::format("{}", most_parts), fmt::format("{}", *parts)},
                          *parts > most_parts ? "with more of them, take a shorter step for the scene"
                                              : "substeps are equal: write subcycle u in 4 for four of them");
  return 1;
}

/// Multistep schemes do not store values at substeps, implicit schemes need no substeps, and semi-Lagrangian advection
/// has no stability limit that substeps would help.
bool fits(Elaboration& elaboration, SourceRange range) {
  const Scheme& scheme = elaboration.problem.scheme;
  if (is_multistep(scheme.time) || is_implicit(scheme.time)) {
    elaboration.sink.report("schemes-do-not-fit", range, {print(scheme.time), "equations with substeps"},
                            "take time = rk2 or rk4");
  } else if (elaboration.blocks.program) {
    elaboration.sink.report("not-allowed-here", range, {"subcycle", "a scene of a program"},
                            "run the kernels several times in the program");
  } else if (scheme.is_semi_lagrangian()) {
    elaboration.sink.report("not-allowed-here", range, {"subcycle", "a scene with semi-Lagrangian advection"},
                            "take advect = upwind(3) or central(4)");
  } else {
    return true;
  }
  return false;
}

}  // namespace

void bind_subcycles(Elaboration& elaboration) {
  std::map<std::string, SourceRange> seen;
  for (const auto& [item, range] : items_of<ast::SubcycleItem>(elaboration.blocks.scene->items)) {
    if (!fits(elaboration, range)) continue;
    const int parts = parts_of(elaboration, item.parts);
    for (const ast::Identifier& field : item.fields) {
      const std::vector<State*> states = find_states(elaboration, field, "parts of a step");
      if (states.empty() || !is_first(elaboration, "the number of substeps", field, states, seen)) continue;
      for (const State* found : states) {
        // u and dt(u) belong to one equation
        const std::string moved = found->velocity_of.empty() ? found->name : found->velocity_of;
        for (State& state : elaboration.problem.states) {
          if (state.name != moved && state.velocity_of != moved) continue;
          state.parts = parts;
          seen.emplace(state.name, field.range);
        }
      }
    }
  }
}

}  // namespace dpde::model
