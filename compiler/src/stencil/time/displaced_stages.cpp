// SPDX-License-Identifier: Apache-2.0
#include "stencil/time/displaced_stages.h"

#include "stencil/build.h"
#include "stencil/lower/custom_adjoint.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

class Displacer {
 public:
  explicit Displacer(const Displacement& by) : by_(by), clock_{{"t", by.time}, {"dt", by.length}} {}

  void move(Stage& stage) const {
    move(stage.kernel);
    stage.time = moved(stage.time);
    if (stage.reading) {
      stage.reading->time = moved(stage.reading->time);
      stage.reading->fields.insert(by_.begins.begin(), by_.begins.end());
    }
    for (Prerequisite& preparation : stage.before) {
      match(
          preparation, [&](Kernel& kernel) { move(kernel); }, [&](Reduce& reduce) { rename(reduce.field); },
          [&](NetworkCall& network_call) {
            for (std::string& input : network_call.inputs) rename(input);
          },
          [&](Transform& transform) {
            for (Transform::Term& term : transform.terms) {
              rename(term.field);
              term.by.argument = moved(term.by.argument);
              term.by.factor = moved(term.by.factor);
            }
          },
          [&](PreparedSolve& solve) {
            rename(solve.right);
            for (std::string& start : solve.starts) rename(start);
            for (std::size_t i = 1; solve.preconditioner && i < solve.preconditioner->inputs.size(); ++i)
              rename(solve.preconditioner->inputs[i]);
            move(solve.kernel);
          });
    }
  }

 private:
  std::string named(const std::string& field) const {
    const auto found = by_.begins.find(field);
    return found == by_.begins.end() ? field : found->second;
  }
  void rename(std::string& field) const { field = named(field); }
  Expr moved(const Expr& e) const {
    return substitute_params(rename_fields(e, [&](const std::string& field) { return named(field); }), clock_);
  }
  void move(Kernel& kernel) const {
    kernel = map_expressions(kernel, [&](const Expr& e) { return moved(e); });
    for (CustomAdjoint& given : kernel.custom_adjoints) {
      rename(given.input);
      const auto name = [&](const std::string& field) { return seeded_by(kernel, field) ? field : named(field); };
      given.value = substitute_params(rename_fields(given.value, name), clock_);
    }
  }

  const Displacement& by_;
  std::map<std::string, Expr> clock_;
};

}  // namespace

std::vector<Stage> displaced(std::vector<Stage> stages, const Displacement& by) {
  const Displacer displacer(by);
  for (Stage& stage : stages) displacer.move(stage);
  return stages;
}

}  // namespace dpde::stencil
