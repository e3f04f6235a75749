// SPDX-License-Identifier: Apache-2.0
#include "stability/whole_fields.h"

#include <algorithm>
#include <cmath>

#include "dpde/runtime/error.h"
#include "model/solves.h"
#include "support/match.h"

namespace dpde::stability {

using namespace stencil;

namespace {

using Names = std::map<std::string, std::string>;  // fields of the step, by what the result calls them

/// `unknowns`: of the model; null in programs.
void collect(const std::vector<Statement>& body, const std::vector<const model::Solve*>* unknowns, Names& found) {
  for (const Statement& statement : body) {
    match(
        statement, [](const Fill&) {}, [](const Fold&) {},
        [&](const Reduce& reduce) { found.emplace(reduce.result, reduce.result); }, [](const NetworkCall&) {},
        [](const Run&) {},
        [&](const Transform& transform) {
          const auto solves = [](const Transform::Term& t) {
            return t.by.function.kind == WaveFunction::Kind::inverse;
          };
          if (std::ranges::any_of(transform.terms, solves)) found.emplace(transform.result, transform.result);
        },
        [&](const Solve& solve) {
          const std::string& field = solve.unknowns.front();
          const auto is_it = [&](const model::Solve* unknown) { return unknown->name == solve.written.field; };
          if (unknowns == nullptr) found.emplace(field, field);
          if (unknowns != nullptr && std::ranges::any_of(*unknowns, is_it)) found.emplace(solve.written.field, field);
        },
        [&](const Repeat& repeat) { collect(repeat.body, unknowns, found); });
  }
}

/// While it lives dt is 0, whatever is thrown.
class WithoutStep {
 public:
  explicit WithoutStep(Workspace& workspace) : workspace_(workspace), dt_(workspace.params().at("dt")) {
    workspace_.set_param("dt", 0);
  }
  ~WithoutStep() { workspace_.set_param("dt", dt_); }
  WithoutStep(const WithoutStep&) = delete;
  WithoutStep& operator=(const WithoutStep&) = delete;

 private:
  Workspace& workspace_;
  double dt_;
};

}  // namespace

std::map<std::string, std::vector<double>> whole_fields(driver::Session& session) {
  const model::Problem& problem = session.problem();
  const driver::Compiled& compiled = session.compiled();
  const bool is_program = !problem.program.empty();
  std::vector<const model::Solve*> unknowns = model::solves_of(problem);
  if (!is_program && model::are_constraints(problem)) unknowns.clear();
  Names names;
  collect(compiled.stencil.find_program(compiled.step_name())->body, is_program ? nullptr : &unknowns, names);
  if (names.empty()) return {};
  Workspace& workspace = session.workspace();
  const dpde_program& step = *compiled.program(compiled.step_name());
  Workspace::Bound bound;
  for (int s = 0; s < session.rollout().state_count(); ++s)
    bound[session.rollout().state_name(s)] = session.rollout().initial(s).base();
  std::map<std::string, std::vector<double>> result;
  try {
    const WithoutStep without_step(workspace);
    workspace.execute(step, problem.t_begin, bound);
    for (const auto& [key, field] : names) result[key] = workspace.dense(field);
  } catch (const Error&) {
    result.clear();  // as of an operator that is divided by dt
  }
  // As of a right side that is divided by dt.
  const auto is_finite = [](double value) { return std::isfinite(value); };
  std::erase_if(result, [&](const auto& entry) { return !std::ranges::all_of(entry.second, is_finite); });
  workspace.release(step);
  return result;
}

}  // namespace dpde::stability
