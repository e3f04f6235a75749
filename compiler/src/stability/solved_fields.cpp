// SPDX-License-Identifier: Apache-2.0
#include "stability/solved_fields.h"

#include <algorithm>

#include "dpde/runtime/error.h"
#include "model/solves.h"

namespace dpde::stability {

using namespace stencil;

namespace {

using Names = std::map<std::string, std::string>;  // fields of the step, by what the result calls them

/// `unknowns`: of the model; null in programs.
void collect(const std::vector<Statement>& body, const std::vector<const model::Solve*>* unknowns, Names& found) {
  for (const Statement& statement : body) {
    if (const Repeat* repeat = std::get_if<Repeat>(&statement)) {
      collect(repeat->body, unknowns, found);
    } else if (const Transform* transform = std::get_if<Transform>(&statement)) {
      const auto solves = [](const Transform::Term& t) { return t.by.function.kind == WaveFunction::Kind::inverse; };
      if (std::ranges::any_of(transform->terms, solves)) found.emplace(transform->result, transform->result);
    } else if (const Solve* solve = std::get_if<Solve>(&statement)) {
      const std::string& field = solve->unknowns.front();
      const auto is_it = [&](const model::Solve* unknown) { return unknown->name == solve->written.field; };
      if (unknowns == nullptr) found.emplace(field, field);
      if (unknowns != nullptr && std::ranges::any_of(*unknowns, is_it)) found.emplace(solve->written.field, field);
    }
  }
}

}  // namespace

std::map<std::string, std::vector<double>> solved_fields(driver::Session& session) {
  const model::Problem& problem = session.problem();
  const driver::Compiled& compiled = session.compiled();
  const bool is_program = !problem.program.empty();
  const std::vector<const model::Solve*> unknowns = model::solves_of(problem);
  if (!is_program && (unknowns.empty() || model::are_constraints(problem))) return {};
  Names names;
  collect(compiled.stencil.find_program(compiled.step_name())->body, is_program ? nullptr : &unknowns, names);
  if (names.empty()) return {};
  Workspace& workspace = session.workspace();
  const dpde_program& step = *compiled.program(compiled.step_name());
  Workspace::Bound bound;
  for (int s = 0; s < session.rollout().state_count(); ++s)
    bound[session.rollout().state_name(s)] = session.rollout().initial(s).base();
  const double dt = workspace.params().at("dt");
  workspace.set_param("dt", 0);
  std::map<std::string, std::vector<double>> result;
  try {
    workspace.execute(step, problem.t_begin, bound);
    for (const auto& [key, field] : names) result[key] = workspace.dense(field);
  } catch (const Error&) {
    result.clear();  // as of an operator that is divided by dt
  }
  workspace.set_param("dt", dt);
  workspace.release(step);
  return result;
}

}  // namespace dpde::stability
