// SPDX-License-Identifier: Apache-2.0
// What a run writes down on its way.
#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "model/from_ast/expressions.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

std::optional<int> interval_of(Draft& draft, const ast::Expr& every, const char* what) {
  const auto interval = evaluate(draft, every, fmt::format("the interval of {}", what));
  const double step = draft.problem.step;
  if (!interval || step == 0) return std::nullopt;
  const auto steps = *interval > 0 ? whole_steps(*interval, step) : std::nullopt;
  if (steps && *steps >= 1 && *steps <= std::numeric_limits<int>::max()) return static_cast<int>(*steps);
  draft.sink.report("output-off-step", every.range(), {what, fmt::format("{}", *interval), fmt::format("{}", step)},
                    fmt::format("the nearest that is one is {}", std::max(1.0, std::round(*interval / step)) * step));
  return std::nullopt;
}

void bind_outputs(Draft& draft) {
  std::map<std::string, SourceRange> seen;
  for (const auto& [item, range] : items_of<ast::OutputItem>(draft.scene->items)) {
    Output output;
    output.origin = {range};
    for (const ast::Identifier& field : item.fields) {
      for (const State* state : find_states(draft, field, "an output")) {
        const auto [first, is_new] = seen.emplace(state->name, field.range);
        if (!is_new) report_duplicate(draft, "the output of " + state->name, field.range, first->second);
        if (is_new) output.fields.push_back(state->name);
      }
    }
    if (item.every) output.every = interval_of(draft, *item.every, "an output").value_or(0);
    draft.problem.outputs.push_back(std::move(output));
  }
}

}  // namespace dpde::model
