// SPDX-License-Identifier: Apache-2.0
#include "stencil/lower/alpha_rename.h"

#include <utility>

#include "stencil/build.h"
#include "stencil/lower/custom_adjoint.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

/// Renames the fields of one stage, in the order of its statements: later reads use the new name.
class OwnNames {
 public:
  OwnNames(std::string stage, NameSupply& taken, const std::map<std::string, std::string>& state_of)
      : stage_(std::move(stage)), taken_(taken), state_of_(state_of) {}

  void rename(Kernel& kernel) const {
    const auto renamed = [&](const std::string& field) { return name_of(field); };
    kernel = map_expressions(kernel, [&](const Expr& e) { return rename_fields(e, renamed); });
    for (CustomAdjoint& given : kernel.custom_adjoints) {
      given.input = name_of(given.input);
      given.value = rename_fields(given.value, [&](const std::string& field) {
        const std::string* stored = seeded_by(kernel, field);
        return stored ? bar_of(name_of(*stored)) : name_of(field);
      });
    }
  }

  void rename(Prerequisite& preparation) {
    match(
        preparation, [&](Kernel& kernel) { rename_stored(kernel); }, [&](Reduce& reduce) { rename_result(reduce); },
        [&](NetworkCall& call) { rename_results(call); }, [&](Transform& transform) { rename_result(transform); },
        [&](PreparedSolve& solve) { rename_parts(solve); });
  }

 private:
  std::string name_of(const std::string& field) const {
    const auto found = names_.find(field);
    return found == names_.end() ? field : found->second;
  }

  void rename_stored(Kernel& kernel) {
    const bool is_operator = !kernel.name.empty();
    const std::vector<std::string> suffixes =
        is_operator ? component_suffixes(kernel.stores.size()) : std::vector<std::string>{};
    const std::string stem = is_operator ? taken_.fresh_stem(kernel.name, suffixes) : "";
    for (std::size_t i = 0; i < kernel.stores.size(); ++i)
      names_[kernel.stores[i].field] = is_operator ? stem + suffixes[i] : taken_.fresh("operand");
    rename(kernel);
    for (Store& store : kernel.stores) store.field = names_[store.field];
    kernel.name = stage_ + "_" + (is_operator ? stem : kernel.stores[0].field);
  }

  void rename_result(Reduce& reduce) {
    reduce.field = name_of(reduce.field);
    const std::string wish = reduce.field + "_" + std::string(dpde::name_of(reduce.kind));
    reduce.result = names_[reduce.result] = taken_.fresh(wish);
  }

  void rename_results(NetworkCall& call) {
    for (std::string& input : call.inputs) input = name_of(input);
    for (std::string& result : call.results) result = names_[result] = taken_.fresh(result);
  }

  void rename_result(Transform& transform) {
    for (Transform::Term& term : transform.terms) term.field = name_of(term.field);
    if (!state_of_.contains(transform.result))
      transform.result = names_[transform.result] = taken_.fresh(transform.result);
  }

  void rename_parts(PreparedSolve& solve) {
    solve.right = name_of(solve.right);
    for (auto* fields : {&solve.guesses, &solve.starts}) {
      for (std::string& field : *fields) field = name_of(field);
    }
    for (std::string* field :
         {&solve.unknown, &solve.image, &solve.at_rest, &solve.of_walls, &solve.total, &solve.between_walls})
      *field = names_[*field] = taken_.fresh(*field);
    if (NetworkCall* call = solve.preconditioner ? &*solve.preconditioner : nullptr) {
      for (std::size_t i = 1; i < call->inputs.size(); ++i) call->inputs[i] = name_of(call->inputs[i]);
      for (std::string* field : {&call->inputs.front(), &call->results.front()})
        *field = names_[*field] = taken_.fresh(*field);
    }
    if (solve.iterations) {
      for (const auto& [what, field] : solve.iterations->all()) *field = names_[*field] = taken_.fresh(*field);
    }
    rename(solve.kernel);
    solve.kernel.stores.front().field = solve.image;
    solve.kernel.name = stage_ + "_" + without_dots(solve.image);
  }

  const std::string stage_;
  NameSupply& taken_;
  const std::map<std::string, std::string>& state_of_;
  std::map<std::string, std::string> names_;
};

}  // namespace

std::vector<Stage> with_own_names(std::vector<Stage> stages, NameSupply taken,
                                  const std::map<std::string, std::string>& state_of) {
  for (const Stage& stage : stages) {
    for (const Let& let : stage.kernel.lets) taken.reserve(let.name);
  }
  for (Stage& stage : stages) {
    if (stage.before.empty()) continue;
    OwnNames names(stage.kernel.name, taken, state_of);
    for (Prerequisite& preparation : stage.before) names.rename(preparation);
    names.rename(stage.kernel);
  }
  return stages;
}

}  // namespace dpde::stencil
