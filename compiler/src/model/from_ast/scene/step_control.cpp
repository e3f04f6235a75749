// SPDX-License-Identifier: Apache-2.0
// time 0 .. 1, step 1/32, tolerance 1e-6: adaptive substeps by the error estimate of the scheme.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "model/analyse/implicit_part.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"
#include "model/print/print_model.h"

namespace dpde::model {

namespace {

/// The setting, else the number in the file; `otherwise` without either, nullopt after a diagnostic.
std::optional<double> positive(Elaboration& elaboration, const std::optional<ast::Expr>& written, const char* what,
                               double otherwise) {
  if (!written) return otherwise;
  const auto value = evaluate(elaboration, *written, what);
  if (!value || *value > 0) return value;
  elaboration.sink.report("bad-step", written->range(), {what, fmt::format("{}", *value)});
  return std::nullopt;
}

std::optional<double> tolerance_of(Elaboration& elaboration, const ast::TimeItem* time) {
  const bool is_set = elaboration.settings.find("tolerance") != nullptr;
  if (!is_set) return positive(elaboration, time ? time->tolerance : std::nullopt, "tolerance", 0);
  const auto value = number_setting(elaboration, "tolerance");
  if (!value || *value > 0) return value;
  elaboration.sink.report("bad-step", time && time->tolerance ? time->tolerance->range() : SourceRange{},
                          {"tolerance", fmt::format("{}", *value)});
  return std::nullopt;
}

/// take time = A, B or C: the methods with an error estimate, only implicit ones in place of an implicit one.
std::string advised_pairs(TimeScheme instead_of) {
  std::vector<std::string_view> names;
  for (const TimeMethod& method : time_methods()) {
    if (estimates_error(&method) && (is_implicit(&method) || !is_implicit(instead_of))) names.push_back(method.name);
  }
  const std::string_view last = names.back();
  names.pop_back();
  return fmt::format("take time = {}{}{}", fmt::join(names, ", "), names.empty() ? "" : " or ", last);
}

/// Whether the scheme estimates the error of a whole step, and nothing else divides steps.
bool can_control(Elaboration& elaboration, SourceRange range) {
  const Scheme& scheme = elaboration.problem.scheme;
  const auto refuse = [&](const char* what, const std::string& hint) {
    elaboration.sink.report("schemes-do-not-fit", range, {print(scheme.time), what}, hint);
    return false;
  };
  if (elaboration.blocks.program) {
    elaboration.sink.report("not-allowed-here", range, {"a tolerance", "a scene of a program"}, "give the step alone");
    return false;
  }
  if (!estimates_error(scheme.time))
    return refuse("a tolerance: it does not estimate its error", advised_pairs(scheme.time));
  if (scheme.is_split()) return refuse("a tolerance for split steps", "leave split out, or the tolerance");
  if (scheme.is_semi_lagrangian())
    return refuse("a tolerance for semi-Lagrangian advection", "take advect = central(2) or upwind(3)");
  if (!items_of<ast::SubcycleItem>(elaboration.blocks.scene->items).empty())
    return refuse("a tolerance and subcycle", "leave subcycle out");
  if (is_implicit(scheme.time) && holds_at_states(elaboration.problem))
    return refuse(
        "a tolerance where the value of a field inside a mask depends on another field: stages use that of the begin "
        "of the step",
        "write a formula of the coordinates and t, or take dopri5");
  if (std::ranges::any_of(elaboration.problem.projections, &Projection::is_each_step))
    return refuse("a tolerance for a constraint each step: its estimate knows nothing of the error in the stages",
                  "write each stage, or project = stage in the scheme");
  if (elaboration.problem.substeps.courant > 0)
    return refuse("a tolerance and a Courant number", "leave courant out: the tolerance keeps steps short enough");
  return true;
}

}  // namespace

void bind_step_control(Elaboration& elaboration) {
  const auto lines = items_of<ast::TimeItem>(elaboration.blocks.scene->items);
  const ast::TimeItem* time = lines.empty() ? nullptr : &lines.front().kind;
  const auto relative = tolerance_of(elaboration, time);
  if (!relative) return;
  if (*relative == 0) {
    for (const std::optional<ast::Expr>* option : {time ? &time->absolute : nullptr, time ? &time->first : nullptr}) {
      if (option != nullptr && *option)
        elaboration.sink.report("not-allowed-here", (*option)->range(), {"this", "a time without a tolerance"},
                                "write step 1/32, tolerance 1e-6, absolute 1e-9, first 1e-3");
    }
    return;
  }
  const SourceRange range = time && time->tolerance ? time->tolerance->range()
                            : lines.empty()         ? SourceRange{}
                                                    : lines.front().range;
  if (!can_control(elaboration, range)) return;
  const auto absolute = positive(elaboration, time ? time->absolute : std::nullopt, "absolute tolerance", *relative);
  const auto first = positive(elaboration, time ? time->first : std::nullopt, "first step", elaboration.problem.step);
  if (absolute && first) elaboration.problem.substeps.control = StepControl{*relative, *absolute, *first};
}

}  // namespace dpde::model
