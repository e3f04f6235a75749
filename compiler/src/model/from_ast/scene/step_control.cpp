// SPDX-License-Identifier: Apache-2.0
// time 0 .. 1, step 1/32, tolerance 1e-6: the parts of steps by the error that their scheme estimates.
#include <fmt/format.h>

#include <algorithm>

#include "model/from_ast/formulas/expressions.h"
#include "model/from_ast/parts.h"
#include "model/analyse/implicit_part.h"
#include "model/print/print_model.h"

namespace dpde::model {

namespace {

/// The setting, else the number that is written; `otherwise` without one, nullopt after a diagnostic.
std::optional<double> positive(Draft& draft, const std::optional<ast::Expr>& written, const char* what,
                               double otherwise) {
  if (!written) return otherwise;
  const auto value = evaluate(draft, *written, what);
  if (!value || *value > 0) return value;
  draft.sink.report("bad-step", written->range(), {what, fmt::format("{}", *value)});
  return std::nullopt;
}

std::optional<double> tolerance_of(Draft& draft, const ast::TimeItem* time) {
  const bool is_set = draft.settings.find("tolerance") != nullptr;
  if (!is_set) return positive(draft, time ? time->tolerance : std::nullopt, "tolerance", 0);
  const auto value = number_setting(draft, "tolerance");
  if (!value || *value > 0) return value;
  draft.sink.report("bad-step", time && time->tolerance ? time->tolerance->range() : SourceRange{},
                    {"tolerance", fmt::format("{}", *value)});
  return std::nullopt;
}

/// Whether the scheme estimates the error of a whole step, and nothing else divides that.
bool can_control(Draft& draft, SourceRange range) {
  const Scheme& scheme = draft.problem.scheme;
  const auto refuse = [&](const char* what, const char* hint) {
    draft.sink.report("schemes-do-not-fit", range, {print(scheme.time), what}, hint);
    return false;
  };
  if (draft.program) {
    draft.sink.report("not-allowed-here", range, {"a tolerance", "a scene of a program"}, "give the step alone");
    return false;
  }
  if (!estimates_error(scheme.time))
    return refuse("a tolerance: it does not estimate its error",
                  is_implicit(scheme.time) ? "take time = ars443" : "take time = bs32 or dopri5, or ars443");
  if (scheme.is_split()) return refuse("a tolerance for steps in parts", "leave split out, or the tolerance");
  if (scheme.follows_flow())
    return refuse("a tolerance for advection along the flow", "take advect = central(2) or upwind(3)");
  if (!items_of<ast::SubcycleItem>(draft.scene->items).empty())
    return refuse("a tolerance and subcycle", "leave subcycle out");
  if (is_implicit(scheme.time) && holds_at_states(draft.problem))
    return refuse("a tolerance where a mask holds a field at what another one is: stages see that as the step begins",
                  "hold it at a formula of place and t, or take dopri5");
  if (std::ranges::any_of(draft.problem.projections, &Projection::is_each_step))
    return refuse("a tolerance for a constraint each step: its estimate knows nothing of the error in the stages",
                  "write each stage, or project = stage in the scheme");
  if (draft.problem.courant > 0)
    return refuse("a tolerance and a Courant number", "leave courant out: the tolerance keeps steps short enough");
  return true;
}

}  // namespace

void bind_step_control(Draft& draft) {
  const auto lines = items_of<ast::TimeItem>(draft.scene->items);
  const ast::TimeItem* time = lines.empty() ? nullptr : &lines.front().kind;
  const auto relative = tolerance_of(draft, time);
  if (!relative) return;
  if (*relative == 0) {
    for (const std::optional<ast::Expr>* option : {time ? &time->absolute : nullptr, time ? &time->first : nullptr}) {
      if (option != nullptr && *option)
        draft.sink.report("not-allowed-here", (*option)->range(), {"this", "a time without a tolerance"},
                          "write step 1/32, tolerance 1e-6, absolute 1e-9, first 1e-3");
    }
    return;
  }
  const SourceRange range = time && time->tolerance ? time->tolerance->range()
                            : lines.empty()         ? SourceRange{}
                                                    : lines.front().range;
  if (!can_control(draft, range)) return;
  const auto absolute = positive(draft, time ? time->absolute : std::nullopt, "absolute tolerance", *relative);
  const auto first = positive(draft, time ? time->first : std::nullopt, "first step", draft.problem.step);
  if (absolute && first) draft.problem.step_control = StepControl{*relative, *absolute, *first};
}

}  // namespace dpde::model
