// SPDX-License-Identifier: Apache-2.0
#include "stability/step/whole_fields.h"

#include <algorithm>

#include "model/analyse/solves.h"
#include "stability/frozen/zero_step.h"
#include "stencil/walk.h"
#include "support/match.h"

namespace dpde::stability {

using namespace stencil;

namespace {

using Names = std::map<std::string, std::string>;  // fields of the step, by their names in the result

/// `unknowns`: the model's; null for programs.
void collect(const std::vector<Statement>& body, const std::vector<const model::Solve*>* unknowns, Names& found) {
  const auto add = [&](const Statement& statement) {
    match(
        statement, [&](const Reduce& reduce) { found.emplace(reduce.result, reduce.result); },
        [&](const Transform& transform) {
          const auto solves = [](const Transform::Term& t) {
            return t.by.function.kind == WaveFunction::Kind::inverse;
          };
          if (std::ranges::any_of(transform.terms, solves)) found.emplace(transform.result, transform.result);
        },
        [&](const Solve& solve) {
          const auto is_it = [&](const model::Solve* unknown) { return unknown->name == solve.written.field; };
          if (unknowns == nullptr)
            for (const std::string& field : solve.unknowns) found.emplace(field, field);
          else if (std::ranges::any_of(*unknowns, is_it))
            found.emplace(solve.written.field, solve.unknowns.front());
        },
        ignored<Fill, Fold, NetworkCall, Run, Repeat>);
  };
  for_each_statement(body, add, Blocks::passes);
}

Names whole_names(const driver::Session& session) {
  const model::Problem& problem = session.problem();
  const driver::Compiled& compiled = session.compiled();
  const bool is_program = !problem.program.empty();
  std::vector<const model::Solve*> unknowns = model::solves_of(problem);
  if (!is_program && model::are_constraints(problem)) unknowns.clear();
  Names names;
  collect(compiled.stencil.find_program(compiled.step_name())->body, is_program ? nullptr : &unknowns, names);
  return names;
}

}  // namespace

bool has_whole_fields(const driver::Session& session) { return !whole_names(session).empty(); }

std::map<std::string, std::vector<double>> whole_fields(driver::Session& session, double t, const CoarseGrid& grid) {
  const Names names = whole_names(session);
  if (names.empty()) return {};
  std::vector<std::string> fields;
  for (const auto& [key, field] : names) fields.push_back(field);
  const auto found = after_step_of_no_length(session, fields, t, grid);
  std::map<std::string, std::vector<double>> result;
  for (const auto& [key, field] : names) {
    if (const auto values = found.find(field); values != found.end()) result[key] = values->second;
  }
  return result;
}

}  // namespace dpde::stability
