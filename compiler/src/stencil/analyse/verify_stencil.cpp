// SPDX-License-Identifier: Apache-2.0
#include "stencil/analyse/verify_stencil.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>

#include "stencil/analyse/effects.h"
#include "stencil/analyse/extents.h"
#include "stencil/analyse/symbol.h"
#include "stencil/analyse/verify_kernel.h"
#include "stencil/analyse/verify_solve.h"
#include "stencil/build.h"
#include "support/contains.h"
#include "support/match.h"
#include "support/names/bound_names.h"

namespace dpde::stencil {

namespace {

using Violations = std::vector<Violation>;

/// Checks of one program, statement by statement.
class ProgramCheck {
 public:
  ProgramCheck(const Module& module, const Program& program, Violations& violations)
      : module_(module), program_(program), violations_(violations) {}

  void run() {
    if (program_.axes.empty() || program_.axes.size() > max_rank) violation("has {} axes", program_.axes.size());
    check_statements();
    statement_ = -1;
    check_results();
    for (const std::string& name : params_) {
      if (fields_.contains(name) || inner_.contains(name)) violation("uses {} both as field and as param", name);
    }
    check_counters();
    for (const std::string& name : inner_) {
      if (fields_.contains(name)) violation("uses {} both in a block, which writes it, and outside", name);
    }
  }

 private:
  template <class... Args>
  void violation(fmt::format_string<Args...> text, Args&&... args) {
    const std::string what = fmt::format(text, std::forward<Args>(args)...);
    violations_.push_back({fmt::format("program {} {}", program_.name, what), program_.name, statement_});
  }

  void check_statements() {
    if (!program_.halos.empty()) violation("has halos of which no fills are made");
    for (const Statement& statement : program_.body) {
      ++statement_;
      match(
          statement, [&](const Fill& fill) { check_fill(fill); }, [&](const Fold& fold) { check_fold(fold); },
          [&](const Reduce& reduce) { check_reduce(reduce); },
          [&](const NetworkCall& network_call) { check_network_call(network_call); },
          [&](const Transform& transform) { check_transform(transform); }, [&](const Run& run) { check_run(run); },
          [&](const Solve& solve) { check_solve(solve); }, [&](const Repeat& repeat) { check_repeat(repeat); });
    }
  }

  /// A pass is checked as a program. Statement numbers include those of blocks, which follow their statement.
  void check_repeat(const Repeat& repeat) {
    if (repeat.count < 1) violation("repeats something {} times", repeat.count);
    const Program pass = pass_of(repeat, program_);
    ProgramCheck inside(module_, pass, violations_);
    inside.statement_ = statement_;
    inside.counters_ = counters_;
    if (!repeat.counter.name.empty() && !inside.counters_.insert(repeat.counter.name).second)
      violation("counts the passes of a repeat by {}, and those of one in it too", repeat.counter.name);
    inside.check_statements();
    statement_ = inside.statement_;
    std::set<std::string> own = inside.written_;
    own.merge(inside.inner_);
    for (const TapeEntry& load : repeat.loads) own.insert(load.field);
    check_carries(repeat, inside);
    check_stacks(repeat, inside);
    inside.params_.erase(repeat.counter.name);
    leave_block(inside, own);
    for (const LoopCarried& carry : repeat.carries) {
      check_write(carry.result);
      grown_[carry.result] = 0;
    }
  }

  /// The block is checked as a program too.
  void check_solve(const Solve& solve) {
    const Program block = operator_of(solve, program_);
    ProgramCheck inside(module_, block, violations_);
    inside.statement_ = statement_;
    inside.counters_ = counters_;
    inside.check_statements();
    statement_ = inside.statement_;
    const std::string all = fmt::format("{}", fmt::join(solve.unknowns, ", "));
    for (const std::string& misfit : misfits_of(solve)) violation("{}", misfit);
    for (const std::string& image : solve.images) {
      if (!inside.is_written(image)) violation("solves for {}, which its block does not write", image);
    }
    if (!effects(module_, solve).sums.empty() || !interface_of(module_, block).networks.empty())
      violation("solves for {} with sums or networks in the block", all);
    std::set<std::string> own = inside.written_;
    own.merge(inside.inner_);
    own.insert(solve.unknowns.begin(), solve.unknowns.end());
    leave_block(inside, own);
    const auto read = [&](const std::string& field) { fields_.insert(field), note_read(field); };
    std::ranges::for_each(solve.rights, read);
    for (const std::string& guess : solve.guesses) read(guess);
    if (solve.preconditioner) {
      const Program alone{program_.name, program_.axes, {*solve.preconditioner}, {}, {}};
      ProgramCheck(module_, alone, violations_).check_statements();
      inner_.insert({solve.preconditioner->inputs.front(), solve.preconditioner->results.front()});
      std::ranges::for_each(fields_beside_residual(solve), read);
    }
    for (const std::string& unknown : solve.unknowns) check_unknown(solve, unknown, inside);
  }

  void check_unknown(const Solve& solve, const std::string& unknown, const ProgramCheck& inside) {
    if (inside.is_written(unknown)) violation("solves for {} and writes it in the block", unknown);
    if (!inside.fields_.contains(unknown)) violation("solves for {}, which its block does not read", unknown);
    if (contains(solve.rights, unknown)) violation("solves for {}, which is the right side", unknown);
    if (std::ranges::count(solve.guesses, unknown) > 0) violation("solves for {}, which it begins with", unknown);
    if (std::ranges::count(solve.unknowns, unknown) > 1) violation("solves for {} more than once", unknown);
    check_write(unknown);
    grown_[unknown] = 0;
  }

  /// Updates the state after a block, whose `own` fields are local to it.
  void leave_block(const ProgramCheck& inside, const std::set<std::string>& own) {
    inner_.insert(inside.written_.begin(), inside.written_.end());
    inner_.insert(inside.inner_.begin(), inside.inner_.end());
    params_.insert(inside.params_.begin(), inside.params_.end());
    for (const std::string& field : inside.fields_) {
      if (own.contains(field)) continue;
      fields_.insert(field);
      if (inside.read_unfilled_.contains(field)) note_read(field);
      if (inside.sets_walls_.contains(field)) check_walls_of_pass(field);
      if (!inside.filled_.contains(field)) continue;
      filled_.erase(field);
      grown_[field] = 0;
    }
  }

  /// A block that fills on walls changes the wall values of an outside field: a later read of the field, or a result,
  /// needs another fill.
  void check_walls_of_pass(const std::string& field) {
    if (read_unfilled_.contains(field)) violation("reads {} before the fill that sets its values on the walls", field);
    sets_walls_.insert(field);
    lost_walls_.insert(field);
  }

  void note_read(const std::string& field) {
    if (filled_.contains(field)) return;
    read_unfilled_.insert(field);
    if (lost_walls_.contains(field))
      violation("reads {}, whose values on the walls a repeat has set, without a fill", field);
  }

  /// Consecutive repeats may use the same counter name.
  void check_counters() {
    for (const std::string& name : counters_of(program_.body)) {
      if (find_bound_name(name) || params_.contains(name) || fields_.contains(name) || inner_.contains(name))
        violation("counts the passes of a repeat by {}, which is something else", name);
    }
  }

  void check_carries(const Repeat& repeat, const ProgramCheck& inside) {
    std::set<std::string> names;
    for (const LoopCarried& carry : repeat.carries) {
      fields_.insert(carry.state);
      if (!names.insert(carry.state).second || !names.insert(carry.next).second)
        violation("has {} or {} in two swaps of a repeat", carry.state, carry.next);
      if (!inside.is_written(carry.next)) violation("swaps {}, which the repeat does not write", carry.next);
      if (inside.is_written(carry.state)) violation("writes {}, which the repeat carries", carry.state);
    }
  }

  void check_stacks(const Repeat& repeat, const ProgramCheck& inside) {
    for (const TapeEntry& save : repeat.saves) {
      const auto is_it = [&](const LoopCarried& carry) { return carry.state == save.field; };
      const auto is_next = [&](const LoopCarried& carry) { return carry.next == save.field; };
      const auto is_loaded = [&](const TapeEntry& load) { return load.field == save.field; };
      const bool differs = inside.is_written(save.field) || std::ranges::any_of(repeat.carries, is_it) ||
                           std::ranges::any_of(repeat.loads, is_loaded);
      if (!differs || std::ranges::any_of(repeat.carries, is_next))
        violation("saves {}, which is no state of the repeat and not its own", save.field);
      if (!stacks_.emplace(save.stack, repeat.count).second) violation("saves twice in {}", save.stack);
    }
    for (const TapeEntry& load : repeat.loads) {
      const auto saved = stacks_.find(load.stack);
      if (saved == stacks_.end() || saved->second != repeat.count)
        violation("loads from {}, which no repeat of {} passes has saved", load.stack, repeat.count);
      if (saved != stacks_.end()) saved->second = 0;
      if (inside.is_written(load.field)) violation("writes {}, which the repeat loads", load.field);
    }
  }

  void check_axes(const std::string& field, const std::vector<AxisBoundary>& axes) {
    fields_.insert(field);
    std::vector<Topology> topologies;
    for (std::size_t a = 0; a < axes.size(); ++a) {
      const AxisBoundary& axis = axes[a];
      topologies.push_back(axis.topology);
      if (axis.topology == Topology::periodic) continue;
      check_side(field, axis.low);
      check_side(field, axis.high);
      if (condition_of(axis.low.kind).turns() || condition_of(axis.high.kind).turns()) check_pole(field, axes, a);
      if (axis.low.on_wall && condition_of(axis.low.kind).keeps_wall())
        violation("has {} as outflow at a low wall, where no value of it is stored", field);
      if (axis.low.on_wall != axis.high.on_wall) violation("has {} on the wall at one side of an axis only", field);
    }
    if (topologies != program_.axes) violation("has other axes than the boundaries of {}", field);
  }

  void check_pole(const std::string& field, const std::vector<AxisBoundary>& axes, std::size_t axis) {
    const std::size_t around = axis == 0 ? 1 : 0;
    if (axis > 1 || axes.size() < 2 || axes[around].topology != Topology::periodic)
      violation("has a pole, but no periodic axis x or y around it, for {}", field);
    if (axes[axis].low.on_wall) violation("has a pole on a wall for {}", field);
  }

  bool is_uniform(const Expr& value) {
    bool uniform = true;
    visit(value, [&](const Expr& e) {
      const Param* p = as<Param>(e);
      if (p) params_.insert(p->name);
      const bool varies = is<Access, Interp, Local, Inside>(e);
      uniform = uniform && !varies;
    });
    return uniform;
  }

  void check_side(const std::string& field, const Side& side) {
    const std::string* wall = wall_field(side);
    if (wall) fields_.insert(*wall);
    if (wall && *wall == field) violation("has a boundary value of {} that is {} itself", field, field);
    const bool plain = wall && std::get<Access>(side.value->kind).offset == Offset{};
    if ((!plain && !is_uniform(side.value)) || !is_uniform(side.a) || !is_uniform(side.b)) {
      violation("has a boundary value of {} that is neither a field nor made of params and numbers", field);
    }
  }

  void check_fill(const Fill& fill) {
    check_axes(fill.field, fill.axes);
    filled_.insert(fill.field);
    if (is_on_walls(fill.axes) && read_unfilled_.contains(fill.field)) {
      violation("reads {} before the fill that sets its values on the walls", fill.field);
    }
    if (is_on_walls(fill.axes)) sets_walls_.insert(fill.field);
    lost_walls_.erase(fill.field);
    walls_of_[fill.field].clear();
    for (const std::string& wall : wall_fields(fill.axes)) {
      if (!written_.contains(wall)) violation("fills {} from {} before that is written", fill.field, wall);
      walls_of_[fill.field][wall] = known_of(wall);
      // The fill has overwritten values that were computed farther out.
      grown_[fill.field] = std::min(grown_of(fill.field), known_of(wall));
    }
  }

  /// Distance to which a field of a condition is known: as far as it was computed, or everywhere after a fill.
  int known_of(const std::string& field) {
    if (!filled_.contains(field)) return grown_of(field);
    int known = std::numeric_limits<int>::max();
    for (const auto& [wall, of_wall] : walls_of_[field]) known = std::min(known, of_wall);
    return known;
  }

  /// Whether the field has values `grow` cells outside: computed there, or set by a fill.
  bool has_halo(const std::string& field, int grow) { return std::max(grown_of(field), known_of(field)) >= grow; }

  void check_fold(const Fold& fold) {
    check_axes(fold.field, fold.axes);
    if (fold.grow < 0) violation("folds {} grown by {}", fold.field, fold.grow);
    if (!written_.contains(fold.field)) violation("folds {} before it is written", fold.field);
    const bool is_bounded =
        std::find(program_.axes.begin(), program_.axes.end(), Topology::bounded) != program_.axes.end();
    if (is_bounded && !has_halo(fold.field, fold.grow))
      violation("folds {} farther out than it was computed", fold.field);
    for (const std::string& wall : wall_fields(fold.axes)) {
      if (!written_.contains(wall)) violation("folds {} into {} before that is written", fold.field, wall);
    }
    filled_.erase(fold.field);
    if (is_bounded) grown_[fold.field] = std::max(grown_of(fold.field), fold.grow);  // all zero now
  }

  void check_reduce(const Reduce& reduce) {
    fields_.insert(reduce.field);
    note_read(reduce.field);
    if (reduce.field == reduce.result) violation("reduces {} to itself", reduce.field);
    int axes = 0;
    for (std::size_t axis = 0; axis < max_rank; ++axis) {
      axes += reduce.over[axis];
      if (reduce.over[axis] && axis >= program_.axes.size())
        violation("reduces {} along an axis it does not have", reduce.field);
    }
    if (axes == 0) violation("reduces {} along no axis", reduce.field);
    check_write(reduce.result);
    grown_[reduce.result] = 0;
  }

  void check_transform(const Transform& transform) {
    if (transform.terms.empty()) violation("transforms nothing to {}", transform.result);
    const std::array<bool, max_rank> axes = axes_of(transform, program_.axes.size());
    for (std::size_t axis = 0; axis < max_rank; ++axis) {
      const bool is_periodic = axis < program_.axes.size() && program_.axes[axis] == Topology::periodic;
      if (axes[axis] && !is_periodic)
        violation("transforms to {} along an axis that is not periodic", transform.result);
    }
    for (const Transform::Term& term : transform.terms) {
      fields_.insert(term.field);
      note_read(term.field);
      if (term.field == transform.result) violation("transforms {} to itself", term.field);
    }
    std::set<std::string> params = params_;  // without wave numbers
    for (const std::string& name : params_of(transform)) params.insert(name);
    for_each_symbol(transform, [&](const Expr& symbol) {
      if (!is_uniform(symbol) || !polynomial_of(symbol))
        violation("transforms to {} by what is no polynomial of wave numbers", transform.result);
    });
    params_ = std::move(params);
    check_write(transform.result);
    grown_[transform.result] = 0;
  }

  void check_network_call(const NetworkCall& network_call) {
    const network::Network* network = module_.find_network(network_call.network);
    if (!network) return violation("applies {}, which does not exist", network_call.network);
    if (network_call.inputs.size() != static_cast<std::size_t>(network->inputs) ||
        network_call.rates.size() != network::rate_count(*network, network_call.mode) ||
        network_call.results.size() != network::result_count(*network, network_call.mode)) {
      violation("applies {}, which has {} inputs and {} outputs, to other numbers of fields", network_call.network,
                network->inputs, network->outputs);
    }
    if (network->rank() != static_cast<int>(program_.axes.size()))
      violation("applies {}, which has {} axes", network_call.network, network->rank());
    for (const std::string& field : fields_read(network_call)) {
      fields_.insert(field);
      note_read(field);
    }
    for (const std::string& field : fields_written(network_call)) {
      const std::vector<std::string> read = fields_read(network_call);
      if (std::find(read.begin(), read.end(), field) != read.end())
        violation("applies {} to {} itself", network_call.network, field);
      check_write(field);
      grown_[field] = 0;
    }
  }

  void check_run(const Run& run) {
    const Kernel* kernel = module_.find_kernel(run.kernel);
    if (!kernel) return violation("runs {}, which does not exist", run.kernel);
    if (kernel->rank != static_cast<int>(program_.axes.size())) {
      return violation("has {} axes and runs {}, which has {}", program_.axes.size(), run.kernel, kernel->rank);
    }
    if (run.grow < 0) violation("runs {} grown by {}", run.kernel, run.grow);
    const Signature s = signature(*kernel);
    for (const std::string& name : s.params) params_.insert(name);
    for (const Signature::Read& read : s.reads) fields_.insert(read.field);
    check_halos(*kernel, s, run.grow);
    for (const std::string& field : s.writes) {
      check_write(field);
      grown_[field] = run.grow;
    }
    for (const std::string& field : s.updates) check_update(field);
  }

  void check_write(const std::string& field) {
    fields_.insert(field);
    if (is_coordinate(field)) violation("writes {}, which is a coordinate", field);
    if (updated_.contains(field)) violation("writes {} after adding to it", field);
    if (!written_.insert(field).second) violation("writes {} twice", field);
    filled_.erase(field);
  }

  void check_update(const std::string& field) {
    fields_.insert(field);
    updated_.insert(field);
    if (!written_.contains(field)) violation("adds to {} before it is written", field);
    filled_.erase(field);
  }

  /// Along periodic axes a read of a neighbour needs a fill. Along bounded axes it may also have been computed on an
  /// extended region; reads of kernels with inside[] are not checked.
  void check_halos(const Kernel& kernel, const Signature& s, int grow) {
    const bool masked = any_part(kernel, [](const Expr& e) { return is<Inside>(e); });
    const std::set<std::string> around = read_around(kernel, program_.axes);
    std::map<std::string, int> extents = extents_of(kernel, grow, program_.axes);
    for (const Signature::Read& read : s.reads) {
      note_read(read.field);
      check_walls(kernel, read, masked, grow);
      if (is_coordinate(read.field) || filled_.contains(read.field)) continue;
      bool needed = around.contains(read.field);
      const int known = grown_of(read.field);
      for (std::size_t axis = 0; axis < program_.axes.size(); ++axis) {
        if (program_.axes[axis] == Topology::periodic) continue;
        const int reach = read.interpolated ? read.halo[axis] + grow : extents[read.field];
        needed = needed || (read.interpolated && known < 1) || (!masked && reach > known);
      }
      if (needed) violation("runs {}, which reads neighbours of {}, without a fill", kernel.name, read.field);
    }
  }

  /// If boundary values are fields, a halo is filled as far as these fields were computed.
  void check_walls(const Kernel& kernel, const Signature::Read& read, bool masked, int grow) {
    if (masked || !filled_.contains(read.field)) return;
    for (const auto& [wall, known] : walls_of_[read.field]) {
      for (std::size_t axis = 0; axis < program_.axes.size(); ++axis) {
        if (program_.axes[axis] == Topology::periodic || read.halo[axis] + grow <= known) continue;
        violation("runs {}, which reads {} farther out than {} was computed", kernel.name, read.field, wall);
        return;
      }
    }
  }

  int grown_of(const std::string& field) const {
    const auto found = grown_.find(field);
    return found == grown_.end() ? 0 : found->second;
  }

  bool is_written(const std::string& field) const { return written_.contains(field) || updated_.contains(field); }

  void check_results() {
    std::set<std::string> states;
    const auto check_result = [&](const std::string& field) {
      if (lost_walls_.contains(field))
        violation("leaves {} with the values on the walls that a repeat has set: it needs a fill", field);
    };
    for (const Swap& swap : program_.swaps) {
      check_result(swap.next);
      if (!is_written(swap.next)) violation("swaps {}, which it does not write", swap.next);
      if (swap.state == swap.next) violation("swaps {} with itself", swap.state);
      if (!states.insert(swap.state).second) violation("swaps {} twice", swap.state);
    }
    for (const std::string& field : program_.keeps) {
      check_result(field);
      if (!is_written(field)) violation("keeps {}, which it does not write", field);
    }
  }

  const Module& module_;
  const Program& program_;
  Violations& violations_;
  int statement_ = -1;
  std::set<std::string> written_, updated_, filled_, read_unfilled_, fields_, params_;
  std::map<std::string, std::map<std::string, int>>
      walls_of_;                       // distance to which each wall field was known when the fill used it
  std::set<std::string> inner_;        // local fields of repeats
  std::set<std::string> counters_;     // of the repeats around this one
  std::set<std::string> sets_walls_;   // filled on walls
  std::set<std::string> lost_walls_;   // filled on walls in a repeat, and not filled again after it
  std::map<std::string, int> stacks_;  // saved stacks, with their number of passes; 0: loaded
  std::map<std::string, int> grown_;   // extended region on which a field was computed, unless a fill overwrote it
};

template <class T>
void check_unique_names(const std::vector<T>& things, const char* what, Violations& violations) {
  std::set<std::string> names;
  for (const T& thing : things) {
    if (!names.insert(thing.name).second)
      violations.push_back({fmt::format("there are two {} {}", what, thing.name), thing.name});
  }
}

}  // namespace

std::vector<Violation> find_violations(const Module& module) {
  Violations violations;
  check_unique_names(module.kernels, "kernels", violations);
  check_unique_names(module.programs, "programs", violations);
  for (const Kernel& kernel : module.kernels) check_kernel(kernel, violations);
  for (const Program& program : module.programs) ProgramCheck(module, program, violations).run();
  for (const Loop& loop : module.loops) {
    for (const std::string& program : loop.programs) {
      if (!module.find_program(program))
        violations.push_back({fmt::format("a loop runs {}, which does not exist", program), ""});
    }
  }
  return violations;
}

std::vector<std::string> verify(const Module& module) {
  std::vector<std::string> texts;
  for (const Violation& violation : find_violations(module)) texts.push_back(violation.text);
  return texts;
}

}  // namespace dpde::stencil
