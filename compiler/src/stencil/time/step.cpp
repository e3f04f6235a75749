// SPDX-License-Identifier: Apache-2.0
#include "stencil/time/step.h"

#include <algorithm>
#include <iterator>
#include <set>

#include "model/analyse/split_terms.h"
#include "model/build.h"
#include "stencil/build.h"
#include "stencil/space/semi_lagrangian.h"
#include "stencil/time/displaced_stages.h"
#include "stencil/time/exponential.h"
#include "stencil/time/multistep.h"
#include "stencil/time/projections.h"
#include "stencil/time/subcycles.h"

namespace dpde::stencil {

namespace {

using model::Split;

/// A substep of a split scheme: some of the terms over a part of the step.
struct SmallerStep {
  Split::Part part;
  double begin, length;                // in steps
  std::vector<Advance> advances = {};  // the equations with these terms
};

std::vector<SmallerStep> smaller_steps(const Split& split) {
  std::vector<SmallerStep> steps;
  if (split.kind == Split::Kind::lie) {
    for (const Split::Part& part : split.parts) steps.push_back({part, 0, 1});
    return steps;
  }
  const std::size_t last = split.parts.size() - 1;
  for (std::size_t i = 0; i < last; ++i) steps.push_back({split.parts[i], 0, 0.5});
  steps.push_back({split.parts[last], 0, 1});
  for (std::size_t i = last; i-- > 0;) steps.push_back({split.parts[i], 0.5, 0.5});
  return steps;
}

/// The equations that have terms of `part`, with these terms only.
std::vector<Advance> advances_of(const model::Problem& problem, const std::vector<Advance>& advances,
                                 const Split::Part& part) {
  std::vector<Advance> result;
  for (const Advance& advance : advances) {
    if (!part.is_of(advance.state)) continue;
    Advance own = advance;
    own.rate = model::terms_for(problem, advance.state, advance.rate, part.terms);
    if (!is_literal(own.rate, 0)) result.push_back(std::move(own));
  }
  return result;
}

/// The substeps that have terms. The last one that changes a state stores it in its result field, earlier ones in
/// another field. The very last substep also copies the states that no substep changes.
std::vector<SmallerStep> planned(Lowering& lowering, const std::vector<Advance>& advances) {
  const model::Problem& problem = lowering.problem();
  std::vector<SmallerStep> steps = smaller_steps(problem.scheme.split);
  for (SmallerStep& step : steps) step.advances = advances_of(problem, advances, step.part);
  std::set<std::string> done;
  for (auto step = steps.rbegin(); step != steps.rend(); ++step) {
    for (Advance& advance : step->advances) {
      if (!done.insert(advance.state).second) advance.into = lowering.field_beside(advance.state, "part");
    }
  }
  for (const Advance& advance : advances) {
    if (!done.contains(advance.state))
      steps.back().advances.push_back({advance.state, 0.0, advance.into, advance.origin});
  }
  std::erase_if(steps, [](const SmallerStep& step) { return step.advances.empty(); });
  return steps;
}

/// Stages of a substep with these terms only.
std::vector<Stage> stages_of_terms(Lowering& lowering, const SmallerStep& step) {
  const Split::Terms terms = step.part.terms;
  if (terms == Split::Terms::advect && lowering.problem().scheme.is_semi_lagrangian())
    return semi_lagrangian_stages(lowering, step.advances);
  StepPart part;
  part.is_projected = false;
  const std::string name = lowering.problem().scene + "_" + model::name_of(terms);
  return time_stages(lowering, step.advances, name, name, part);
}

std::vector<Stage> split_stages(Lowering& lowering, const std::vector<Advance>& advances) {
  std::vector<Stage> stages;
  Displacement by{{}, param("t"), param("dt")};
  for (const SmallerStep& step : planned(lowering, advances)) {
    by.time = step.begin == 0 ? param("t") : param("t") + step.begin * param("dt");
    by.length = step.length == 1 ? param("dt") : step.length * param("dt");
    std::ranges::move(displaced(stages_of_terms(lowering, step), by), std::back_inserter(stages));
    for (const Advance& advance : step.advances) by.begins[advance.state] = advance.into;
  }
  return stages;
}

/// The projection at the end of the step.
std::vector<Stage> projected_once(Lowering& lowering, const std::vector<Advance>& advances, const std::string& name) {
  FieldsOfStates into;
  for (const Advance& advance : advances) into[advance.state] = advance.into;
  const FieldsOfStates left = before_projection(lowering, into);
  std::vector<Advance> free;
  for (const Advance& advance : advances) {
    const auto field = left.find(advance.state);
    if (field != left.end()) free.push_back({advance.state, advance.rate, field->second, advance.origin});
  }
  std::vector<Stage> stages =
      lowering.problem().scheme.is_split() ? split_stages(lowering, free) : semi_lagrangian_stages(lowering, free);
  std::ranges::move(projection_stages(lowering, {name, left, into, param("t") + param("dt"), param("dt"), param("dt")}),
                    std::back_inserter(stages));
  return stages;
}

}  // namespace

std::vector<Stage> step_stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& name) {
  const model::Scheme& scheme = lowering.problem().scheme;
  if (scheme.is_split() || scheme.is_semi_lagrangian()) return projected_once(lowering, advances, name);
  if (model::is_multistep(scheme.time)) return multistep_stages(lowering, advances, name);
  if (model::is_exponential(scheme.time)) return exponential_stages(lowering, advances, lowering.problem().scene);
  return subcycled_stages(lowering, advances, name);
}

}  // namespace dpde::stencil
