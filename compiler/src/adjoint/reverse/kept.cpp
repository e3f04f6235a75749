// SPDX-License-Identifier: Apache-2.0
#include "adjoint/reverse/kept.h"

#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "adjoint/reverse/accumulating_adjoint.h"
#include "stencil/analyse/effects.h"
#include "stencil/build.h"
#include "stencil/passes/passes.h"
#include "stencil/walk.h"
#include "support/match.h"
#include "support/names/name_supply.h"

namespace dpde::adjoint {

namespace {

using stencil::Expr;
using stencil::Kernel;
using stencil::Module;
using stencil::Program;

/// Loads that the adjoint must save: the step needs a store for each stored value.
constexpr std::size_t least_reads_spared = 12;
constexpr int most_nodes = 1000;  // of an expanded let: nested squares grow exponentially

using Fields = std::set<std::string>;

/// The run of a program that consists of fills and one run over the interior; else nullptr.
const stencil::Run* only_run(const Program& program) {
  const stencil::Run* found = nullptr;
  for (const stencil::Statement& statement : program.body) {
    const bool is_plain = match(
        statement, always<true, stencil::Fill>,
        [&](const stencil::Run& run) { return std::exchange(found, &run) == nullptr && run.grow == 0; },
        always<false, stencil::Fold, stencil::Reduce, stencil::NetworkCall, stencil::Transform, stencil::Solve,
               stencil::Repeat>);
    if (!is_plain) return nullptr;
  }
  return found;
}

/// Whether the program consists of fills, folds and runs that do not change the states.
bool is_plain_adjoint(const Module& module, const Program& program, const Fields& states) {
  return std::ranges::all_of(program.body, [&](const stencil::Statement& statement) {
    const stencil::Effects e = stencil::effects(module, statement);
    const auto touches = [&](const std::vector<std::string>& fields) {
      return std::ranges::any_of(fields, [&](const std::string& field) { return states.contains(field); });
    };
    return !touches(e.writes) && !touches(e.updates) &&
           is_one_of<stencil::Fill, stencil::Fold, stencil::Run>(statement);
  });
}

using Reads = std::set<std::pair<std::string, stencil::Offset>>;

Reads reads_of(const Expr& e) {
  Reads reads;
  visit(e, [&](const Expr& part) {
    if (const auto* access = as<stencil::Access>(part)) reads.emplace(access->field, access->offset);
  });
  return reads;
}

/// The name of a field and the value stored in it.
using KeptValue = std::pair<std::string, Expr>;

using StandsFor = std::function<std::optional<Expr>(const Expr&)>;

/// Finds the largest expressions of a kernel in states, parameters and numbers only.
class StateValues {
 public:
  explicit StateValues(const Fields& states) : states_(states) {}

  /// The kernel with each such value replaced by `stands_for(value)`, unless that is nullopt. If the kernel also runs
  /// outside the interior, where no values are stored, only values that are read inside are replaced.
  Kernel replaced(Kernel kernel, bool is_grown, const StandsFor& stands_for) {
    lets_.clear();
    sizes_.clear();
    known_.clear();
    const Kernel whole = kernel;  // keeps the nodes of known_ alive
    for (stencil::Let& let : kernel.lets) {
      note(let);
      let.value = replaced(let.value, !is_grown, stands_for);
    }
    for (stencil::Store& store : kernel.stores) store.value = replaced(store.value, !is_grown, stands_for);
    for (stencil::Sum& sum : kernel.sums) sum.value = replaced(sum.value, !is_grown, stands_for);
    for (stencil::Scatter& scatter : kernel.scatters) scatter.value = replaced(scatter.value, !is_grown, stands_for);
    return stencil::with_lets_inlined(kernel);
  }

 private:
  /// Whether `e` has only states, parameters, numbers, and lets of these that are short enough to be expanded.
  bool is_made_of_states(const Expr& e) {
    const auto known = known_.find(&e.node());
    if (known != known_.end()) return known->second;
    const bool is_made = match(
        e->kind, [](const Literal&) { return true; }, [](const stencil::Param&) { return true; },
        [&](const stencil::Local& local) { return lets_.contains(local.name); },
        [&](const stencil::Access& access) { return states_.contains(access.field); },
        [](const stencil::Interp&) { return false; }, [](const stencil::Inside&) { return false; },
        [&](const stencil::Neg& neg) { return is_made_of_states(neg.operand); },
        [&](const stencil::Binary& binary) {
          return is_made_of_states(binary.left) && is_made_of_states(binary.right);
        },
        [](const stencil::Call&) { return false; }, [](const stencil::Select&) { return false; });
    return known_[&e.node()] = is_made;
  }
  Expr written_out(const Expr& e) const {
    const auto* local = as<stencil::Local>(e);
    if (local != nullptr) return lets_.at(local->name);
    return map_children(e, [this](const Expr& child) { return written_out(child); });
  }
  void note(const stencil::Let& let) {
    int nodes = 0;
    visit(let.value, [&](const Expr& part) {
      const auto* local = as<stencil::Local>(part);
      nodes = std::min(most_nodes + 1, nodes + (local == nullptr ? 1 : sizes_.at(local->name)));
    });
    sizes_[let.name] = nodes;
    if (nodes <= most_nodes && is_made_of_states(let.value)) lets_.emplace(let.name, written_out(let.value));
  }
  Expr replaced(const Expr& e, bool at_cells, const StandsFor& stands_for) {
    if (at_cells && is_made_of_states(e)) {
      const Expr value = written_out(e);
      const std::optional<Expr> other = reads_of(value).empty() ? std::nullopt : stands_for(value);
      if (other) return *other;
    }
    const auto* choice = as<stencil::Select>(e);
    const bool is_choice_of_cells = choice != nullptr && choice->condition == stencil::inside({}, 0);
    return map_children(e, [&](const Expr& child) {
      const bool is_at_cells = at_cells || (is_choice_of_cells && &child.node() == &choice->yes.node());
      return replaced(child, is_at_cells, stands_for);
    });
  }

  const Fields& states_;
  std::map<std::string, Expr> lets_;  // lets of states, expanded
  std::map<std::string, int> sizes_;  // nodes of each expanded let, at most most_nodes + 1
  std::map<const stencil::Node*, bool> known_;
};

/// Names of fields, parameters, sums and lets.
NameSupply names_in(const Module& module) {
  NameSupply names;
  for (const Kernel& kernel : module.kernels) {
    const stencil::Signature s = stencil::signature(kernel);
    for (const stencil::Signature::Read& read : s.reads) names.reserve(read.field);
    for (const auto* list : {&s.writes, &s.updates, &s.params, &s.sums})
      for (const std::string& name : *list) names.reserve(name);
    for (const stencil::Let& let : kernel.lets) names.reserve(let.name);
  }
  return names;
}

Fields states_read(const std::vector<Kernel>& kernels, const Fields& states) {
  Fields read;
  for (const Kernel& kernel : kernels) {
    for (const stencil::Signature::Read& each : stencil::signature(kernel).reads) {
      if (states.contains(each.field)) read.insert(each.field);
    }
  }
  return read;
}

/// Whether storing saves enough loads of the adjoint, with at most one stored field per state that is no longer read.
bool pays(const std::vector<KeptValue>& kept, std::size_t states_spared) {
  std::size_t reads = 0;
  for (const auto& [name, value] : kept) reads += reads_of(value).size() - 1;
  return kept.size() <= states_spared && reads >= least_reads_spared;
}

/// The step's kernel with stores of these values; nullopt if the step does not compute one of them.
std::optional<Kernel> keeping_kernel(const Kernel& step, const std::vector<KeptValue>& kept, StateValues& values,
                                     NameSupply& names) {
  std::map<std::string, std::string> lets;  // of each field
  Kernel keeping = values.replaced(step, false, [&](const Expr& value) -> std::optional<Expr> {
    const auto found = std::ranges::find(kept, value, &KeptValue::second);
    if (found == kept.end()) return std::nullopt;
    const auto let = lets.find(found->first);
    if (let != lets.end()) return stencil::local(let->second);
    return stencil::local(lets[found->first] = names.fresh(found->first + "_now"));
  });
  if (lets.size() < kept.size()) return std::nullopt;
  for (const auto& [field, value] : kept) {
    keeping.lets.insert(keeping.lets.begin(), {lets.at(field), value});
    keeping.stores.push_back({field, false, stencil::local(lets.at(field)), {}});
  }
  return keeping;
}

bool grows(const Program& program, const std::string& kernel) {
  bool grows = false;
  for_each_kind<stencil::Run>(
      program.body, [&](const stencil::Run& run) { grows = grows || (run.kernel == kernel && run.grow > 0); });
  return grows;
}

bool fills_one_of(const Module& module, const stencil::Statement& statement, const Fields& fields) {
  return std::ranges::any_of(stencil::effects(module, statement).fills,
                             [&](const std::string& field) { return fields.contains(field); });
}

}  // namespace

std::optional<StoringPair> add_storing_pair(const std::string& of_step, const std::string& of_adjoint, Module& module) {
  const StoringPair pair{of_step + "_storing", of_adjoint + "_from_stored"};
  const Program *step = module.find_program(of_step), *adjoint = module.find_program(of_adjoint);
  if (!step || !adjoint || module.find_program(pair.step) || module.find_program(pair.adjoint)) return std::nullopt;
  Fields states;
  for (const stencil::Swap& swap : step->swaps) states.insert(swap.state);
  const stencil::Run* const run = only_run(*step);
  if (run == nullptr || !is_plain_adjoint(module, *adjoint, states)) return std::nullopt;
  NameSupply names = names_in(module);
  StateValues values(states);
  std::vector<KeptValue> found;
  std::vector<Kernel> before, after;
  for (const Kernel* kernel : stencil::kernels_run(module, *adjoint)) {
    before.push_back(*kernel);
    after.push_back(values.replaced(*kernel, grows(*adjoint, kernel->name), [&](const Expr& value) {
      auto at = std::ranges::find(found, value, &KeptValue::second);
      if (at == found.end() && found.size() > states.size()) return std::optional(value);  // too many already
      if (at == found.end()) at = found.insert(at, {names.fresh("kept"), value});
      return std::optional(stencil::access(at->first));
    }));
  }
  Fields spared = states_read(before, states);
  for (const std::string& state : states_read(after, states)) spared.erase(state);
  if (!pays(found, spared.size())) return std::nullopt;
  std::optional<Kernel> keeping = keeping_kernel(stencil::kernel_of(module, *run), found, values, names);
  if (!keeping) return std::nullopt;

  Program storing_step = *step, from_stored = *adjoint;
  storing_step.name = pair.step;
  from_stored.name = pair.adjoint;
  for (const auto& [name, value] : found) storing_step.keeps.push_back(name);
  const std::string kernel_name = add_kernel(module, std::move(*keeping), "_storing");
  for_each_kind<stencil::Run>(storing_step.body, [&](stencil::Run& r) { r.kernel = kernel_name; });
  std::map<std::string, std::string> renamed;
  for (std::size_t k = 0; k < before.size(); ++k) {
    if (!states_read({before[k]}, states).empty())
      renamed[before[k].name] = add_kernel(module, std::move(after[k]), "_from_stored");
  }
  for_each_kind<stencil::Run>(from_stored.body, [&](stencil::Run& r) {
    if (renamed.contains(r.kernel)) r.kernel = renamed.at(r.kernel);
  });
  std::erase_if(from_stored.body,
                [&](const stencil::Statement& statement) { return fills_one_of(module, statement, spared); });
  module.programs.push_back(std::move(storing_step));
  module.programs.push_back(std::move(from_stored));
  return pair;
}

}  // namespace dpde::adjoint
