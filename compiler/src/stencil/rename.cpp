// SPDX-License-Identifier: Apache-2.0
#include "stencil/rename.h"

#include "stencil/build.h"
#include "stencil/walk.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

class Renamer {
 public:
  Renamer(const Module& module, const Renaming& renaming, Module& kernels)
      : module_(module), renaming_(renaming), kernels_(kernels) {}

  std::vector<Statement> run(std::vector<Statement> statements) {
    for_each_statement(statements, [&](Statement& statement) {
      match(
          statement, [&](OneOf<Fill, Fold> auto& halo) { rename_sides(halo); },
          [&](Reduce& reduce) { rename(reduce.field), rename(reduce.result); },
          [&](NetworkCall& network_call) { rename_fields_of(network_call); },
          [&](Transform& transform) {
            for (Transform::Term& term : transform.terms) rename(term.field);
            rename(transform.result);
          },
          [&](Run& run) { run.kernel = copy_of(run.kernel); },
          [&](Solve& solve) {
            for (auto* fields : {&solve.images, &solve.rights, &solve.unknowns}) {
              for (std::string& field : *fields) rename(field);
            }
            for (std::string& guess : solve.guesses) rename(guess);
            if (solve.preconditioner) rename_fields_of(*solve.preconditioner);
          },
          [&](Repeat& repeat) {
            for (LoopCarried& carry : repeat.carries) rename(carry.state), rename(carry.next), rename(carry.result);
            for (auto* all : {&repeat.saves, &repeat.loads}) {
              for (TapeEntry& stacked : *all) rename(stacked.field), rename(stacked.stack);
            }
          });
    });
    return statements;
  }

 private:
  void rename(std::string& name) const { name = renaming_.field(name); }
  Expr renamed(const Expr& e) const {
    return rename_fields(e, [&](const std::string& field) { return renaming_.field(field); });
  }

  void rename_fields_of(NetworkCall& network_call) const {
    for (auto* names : {&network_call.inputs, &network_call.rates, &network_call.results}) {
      for (std::string& name : *names) rename(name);
    }
  }

  void rename_sides(auto& fill) const {
    rename(fill.field);
    fill.axes = map_sides(std::move(fill.axes), [&](const Expr& e) { return renamed(e); });
  }

  const std::string& copy_of(const std::string& name) {
    const auto known = copies_.find(name);
    if (known != copies_.end()) return known->second;
    Kernel copy = map_expressions(*module_.find_kernel(name), [&](const Expr& e) { return renamed(e); });
    copy.name = renaming_.new_kernel(name);
    copy.custom_adjoints.clear();
    for (Store& store : copy.stores) rename(store.field);
    for (Scatter& scatter : copy.scatters) rename(scatter.target.field);
    kernels_.kernels.push_back(std::move(copy));
    return copies_.emplace(name, kernels_.kernels.back().name).first->second;
  }

  const Module& module_;
  const Renaming& renaming_;
  Module& kernels_;
  std::map<std::string, std::string> copies_;
};

}  // namespace

std::vector<Statement> renamed(const Module& module, const std::vector<Statement>& statements, const Renaming& renaming,
                               Module& kernels) {
  return Renamer(module, renaming, kernels).run(statements);
}

}  // namespace dpde::stencil
