// SPDX-License-Identifier: Apache-2.0
// Backward liveness over programs. A kernel that several programs run keeps the parts that any of them needs, and then
// has the reads of all these parts in each. So live parts are first extended to a fixed point; then the rest is
// removed.
#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "stencil/analyse/effects.h"
#include "stencil/analyse/extents.h"
#include "stencil/build.h"
#include "stencil/lower/custom_adjoint.h"
#include "stencil/passes/passes.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

using NameSet = std::set<std::string>;

/// Goes from the last let to the first, once: a let is read only by later lets and statements.
Kernel without_unused_lets(Kernel kernel) {
  NameSet used;
  const auto note = [&](const Expr& part) {
    if (const Local* l = as<Local>(part)) used.insert(l->name);
  };
  std::vector<Let> lets = std::exchange(kernel.lets, {});
  visit(kernel, note);
  for (auto let = lets.rbegin(); let != lets.rend(); ++let) {
    if (!used.contains(let->name)) continue;
    visit(let->value, note);
    kernel.lets.push_back(std::move(*let));
  }
  std::reverse(kernel.lets.begin(), kernel.lets.end());
  return kernel;
}

/// The kernel with its sums and the stores and scatters to `fields`.
Kernel restricted(Kernel kernel, const NameSet& fields) {
  std::erase_if(kernel.scatters, [&](const Scatter& scatter) { return !fields.contains(scatter.target.field); });
  return without_idle_formulas(without_unused_lets(with_stores_only(std::move(kernel), fields)));
}

/// Walks the statements of one program from its end.
class Liveness {
 public:
  Liveness(const Module& module, const Program& program, std::map<std::string, NameSet>& live_parts)
      : module_(module), program_(program), live_parts_(live_parts) {
    for (const Swap& swap : program.swaps) live_.insert(swap.next);
    live_.insert(program.keeps.begin(), program.keeps.end());
  }

  /// Returns the statements that have an effect, in order.
  std::vector<Statement> run() {
    std::vector<Statement> kept;
    const auto keep_if = [&](bool has_effect, const auto& statement) {
      if (has_effect) kept.push_back(statement);
    };
    for (auto statement = program_.body.rbegin(); statement != program_.body.rend(); ++statement) {
      match(
          *statement, [&](const Fill& fill) { keep_if(pass_fill(fill), fill); },
          [&](const Fold& fold) {
            const bool has_effect = pass_fold(fold);
            keep_if(has_effect, without_dead_walls(fold));
          },
          [&](const Reduce& reduce) { keep_if(pass_reduce(reduce), reduce); },
          [&](const NetworkCall& network_call) {
            const bool has_effect = pass_network_call(network_call);
            keep_if(has_effect, without_dead_results(network_call));
          },
          [&](const Transform& transform) { keep_if(pass_transform(transform), transform); },
          [&](const Run& run) { keep_if(pass_run(run), run); },
          [&](Solve solve) {
            const bool has_effect = pass_solve(solve);
            keep_if(has_effect, solve);
          },
          [&](Repeat repeat) {
            const bool has_effect = pass_repeat(repeat);
            keep_if(has_effect, repeat);
          });
    }
    std::reverse(kept.begin(), kept.end());
    return kept;
  }

 private:
  bool pass_fill(const Fill& fill) {
    const bool sets_cells = is_on_walls(fill.axes) && live_.contains(fill.field);
    if (live_halos_.erase(fill.field) == 0 && !sets_cells) return false;
    live_.insert(fill.field);
    for (const std::string& wall : wall_fields(fill.axes)) {
      live_.insert(wall);
      live_halos_.insert(wall);
    }
    return true;
  }

  bool pass_fold(const Fold& fold) {
    bool has_effect = live_.contains(fold.field);
    for (const std::string& wall : wall_fields(fold.axes)) has_effect = has_effect || live_.contains(wall);
    if (!has_effect) return false;
    live_.insert(fold.field);
    live_halos_.insert(fold.field);
    return true;
  }

  bool pass_reduce(const Reduce& reduce) {
    if (!is_live(reduce.result)) return false;
    live_.erase(reduce.result);
    live_.insert(reduce.field);
    return true;
  }

  bool pass_transform(const Transform& transform) {
    if (!is_live(transform.result)) return false;
    live_.erase(transform.result);
    for (const Transform::Term& term : transform.terms) live_.insert(term.field);
    return true;
  }

  /// Reduces the block to the statements that the image depends on. False if the solve is dead.
  bool pass_solve(Solve& solve) {
    if (std::ranges::none_of(solve.unknowns, [&](const std::string& field) { return is_live(field); })) return false;
    const Program block = operator_of(solve, program_);
    Liveness inside(module_, block, live_parts_);
    solve.body = inside.run();
    for (Statement& step : solve.step) inside.pass_step(std::get<Solve>(step));
    for (const std::string& unknown : solve.unknowns) {
      for (auto* fields : {&live_, &live_halos_, &inside.live_}) fields->erase(unknown);
    }
    live_.merge(inside.live_);
    live_.insert(solve.rights.begin(), solve.rights.end());
    live_.insert(solve.guesses.begin(), solve.guesses.end());
    for (const std::string& field : fields_beside_residual(solve)) live_.insert(field);
    return true;
  }

  /// The result of a Newton step is always used.
  void pass_step(Solve& step) {
    live_.insert(step.unknowns.begin(), step.unknowns.end());
    pass_solve(step);
    for (const std::string& right : step.rights) live_.erase(right);
  }

  bool pass_network_call(const NetworkCall& network_call) {
    dead_results_.clear();
    bool has_effect = network_call.weights && network::adds_to_weights(network_call.mode);
    for (const std::string& result : fields_written(network_call)) {
      has_effect = has_effect || is_live(result);
      if (!is_live(result)) dead_results_.insert(result);
      live_.erase(result);
    }
    if (!has_effect) return false;
    for (const std::string& field : fields_read(network_call)) live_.insert(field);
    return true;
  }

  Statement without_dead_results(NetworkCall network_call) const {
    for (std::string& result : network_call.results) {
      if (network::adds_to_weights(network_call.mode) && dead_results_.contains(result)) result.clear();
    }
    return network_call;
  }

  /// Removes dead fields of boundary values from a fold: it must not add to fields that may be removed.
  Statement without_dead_walls(Fold fold) const {
    fold.axes = map_sides(fold.axes, [&](const Expr& e) {
      const Access* wall = as<Access>(e);
      return wall && !live_.contains(wall->field) ? Expr(0.0) : e;
    });
    return fold;
  }

  bool pass_run(const Run& run) {
    const Kernel& kernel = *module_.find_kernel(run.kernel);
    NameSet needed;
    for (const Store& store : kernel.stores) {
      if (is_live(store.field)) needed.insert(store.field);
    }
    for (const Scatter& scatter : kernel.scatters) {
      if (is_live(scatter.target.field)) needed.insert(scatter.target.field);
    }
    if (needed.empty() && kernel.sums.empty()) return false;
    NameSet& parts = live_parts_[kernel.name];
    parts.insert(needed.begin(), needed.end());
    const Kernel left = restricted(kernel, parts);
    const Signature s = signature(left);
    for (const std::string& field : s.writes) live_.erase(field);
    for (const Signature::Read& read : s.reads) live_.insert(read.field);
    live_halos_.merge(read_beyond(left, run.grow, program_.axes));
    return true;
  }

  /// Reduces a repeat to its live part. A carried field may be needed by other carried fields, hence a fixed point.
  bool pass_repeat(Repeat& repeat) {
    std::erase_if(repeat.saves, [&](const TapeEntry& save) { return live_stacks_.erase(save.stack) == 0; });
    const auto is_saved = [&](const LoopCarried& carry) {
      return std::ranges::any_of(repeat.saves, [&](const TapeEntry& save) { return save.field == carry.state; });
    };
    Repeat live = repeat;
    std::erase_if(live.carries, [&](const LoopCarried& carry) { return !is_live(carry.result) && !is_saved(carry); });
    for (const LoopCarried& carry : repeat.carries) {
      live_.erase(carry.result);
      live_halos_.erase(carry.result);
    }
    NameSet needed;
    std::size_t before = 0;
    do {
      before = live.carries.size();
      Program pass = pass_of(live, program_);
      for (const TapeEntry& save : live.saves) pass.keeps.push_back(save.field);
      Liveness inside(module_, pass, live_parts_);
      live.body = inside.run();
      needed = std::move(inside.live_);
      live.carries.clear();
      for (const LoopCarried& carry : repeat.carries) {
        const auto was = std::ranges::find(pass.swaps, Swap{carry.state, carry.next});
        if (was != pass.swaps.end() || needed.contains(carry.state)) live.carries.push_back(carry);
      }
      if (live.carries.size() != before) live.body = repeat.body;
    } while (live.carries.size() != before);
    if (live.body.empty() && live.saves.empty()) return false;
    std::erase_if(live.loads, [&](const TapeEntry& load) { return !needed.contains(load.field); });
    for (const TapeEntry& load : live.loads) {
      needed.erase(load.field);
      live_stacks_.insert(load.stack);
    }
    for (const LoopCarried& carry : live.carries) needed.insert(carry.state);
    live_.merge(needed);
    repeat = std::move(live);
    return true;
  }

  bool is_live(const std::string& field) const { return live_.contains(field) || live_halos_.contains(field); }

  const Module& module_;
  const Program& program_;
  std::map<std::string, NameSet>& live_parts_;
  NameSet live_, live_halos_, live_stacks_;
  NameSet dead_results_;  // of the last network call
};

}  // namespace

Module remove_dead_code(const Module& module) {
  std::map<std::string, NameSet> live_parts, before;
  do {
    before = live_parts;
    for (const Program& program : module.programs) Liveness(module, program, live_parts).run();
  } while (live_parts != before);

  Module result = module;
  for (Program& program : result.programs) program.body = Liveness(module, program, live_parts).run();
  const Parts before_it = parts_of(module.programs), after_it = parts_of(result.programs);
  std::erase_if(result.kernels, [&](const Kernel& k) {
    return before_it.kernels.contains(k.name) && !after_it.kernels.contains(k.name);
  });
  for (Kernel& kernel : result.kernels) {
    kernel = after_it.kernels.contains(kernel.name) ? restricted(kernel, live_parts[kernel.name])
                                                    : without_unused_lets(kernel);
  }
  return result;
}

}  // namespace dpde::stencil
