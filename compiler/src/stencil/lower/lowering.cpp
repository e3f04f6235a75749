// SPDX-License-Identifier: Apache-2.0
#include "stencil/lower/lowering.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "model/boundary/wall_coefficient.h"
#include "model/boundary/wall_formula.h"
#include "stencil/build.h"
#include "stencil/lower/alpha_rename.h"
#include "stencil/lower/walls.h"
#include "stencil/passes/displaced_values.h"
#include "stencil/passes/place_fills.h"
#include "support/contains.h"
#include "support/match.h"
#include "support/names/bound_names.h"
#include "support/names/wave_names.h"

namespace dpde::stencil {

namespace {

bool is_read_beyond_the_cell(const Signature::Read& read) {
  if (read.interpolated) return true;
  for (const int width : read.halo) {
    if (width > 0) return true;
  }
  return false;
}

/// All reads of a preparation.
std::vector<Signature::Read> reads_of(const Prerequisite& preparation) {
  using Reads = std::vector<Signature::Read>;
  return match(
      preparation, [](const Kernel& kernel) { return signature(kernel).reads; },
      [](const Reduce& reduce) {
        return Reads{{reduce.field, {}, false}};
      },
      [](const NetworkCall& network_call) {
        Reads reads;
        for (const std::string& field : network_call.inputs) reads.push_back({field, {}, false});
        return reads;
      },
      [](const Transform& transform) {
        Reads reads;
        for (const Transform::Term& term : transform.terms) reads.push_back({term.field, {}, false});
        return reads;
      },
      [](const PreparedSolve& solve) {  // its block fills what it reads
        Reads reads{{solve.right, {}, false}};
        for (const auto* fields : {&solve.guesses, &solve.starts}) {
          for (const std::string& field : *fields) reads.push_back({field, {}, false});
        }
        for (std::size_t i = 1; solve.preconditioner && i < solve.preconditioner->inputs.size(); ++i)
          reads.push_back({solve.preconditioner->inputs[i], {}, false});
        for (const Signature::Read& read : signature(solve.kernel).reads) {
          if (read.field != solve.unknown) reads.push_back({read.field, {}, false});
        }
        return reads;
      });
}

/// Halo width that the block of a solve reads; 0 for other preparations.
int width_inside(const Prerequisite& preparation) {
  return match(preparation, always<0, Kernel, Reduce, NetworkCall, Transform>, [](const PreparedSolve& solve) {
    int width = 0;
    for (const Signature::Read& read : signature(solve.kernel).reads)
      width = std::max(width, *std::ranges::max_element(read.halo));
    return width;
  });
}

/// Whether the stage has preparations only: its kernel is empty.
bool is_idle(const Kernel& kernel) { return kernel.stores.empty() && kernel.sums.empty() && kernel.scatters.empty(); }

int width_of(const Signature::Read& read) { return *std::max_element(read.halo.begin(), read.halo.end()); }

/// Whether a solve of the stage reads what the kernel stores.
bool is_read_by_solve(const Stage& stage, const Kernel& kernel) {
  return std::ranges::any_of(stage.before, [&](const Prerequisite& preparation) {
    const auto* solve = std::get_if<PreparedSolve>(&preparation);
    return solve != nullptr && std::ranges::any_of(kernel.stores, [&](const Store& store) {
             return signature(solve->kernel).find_read(store.field) != nullptr;
           });
  });
}

/// For each preparation of a stage the number of cells beyond walls at which it runs: as far as its results are read.
/// Formulas of coordinates, such as moving masks, are instead filled like coefficients if the grid also has periodic
/// axes, or if a solve reads them.
std::vector<int> grows_of(const Stage& stage, const std::vector<Topology>& axes) {
  const bool has_walls = std::ranges::count(axes, Topology::bounded) > 0;
  const bool has_rings = std::ranges::count(axes, Topology::periodic) > 0;
  const auto is_filled = [&](const Kernel& kernel) {
    const std::vector<Signature::Read> reads = signature(kernel).reads;
    const bool is_formula = std::ranges::all_of(reads, [](const auto& read) { return is_coordinate(read.field); });
    return is_formula && (has_rings || is_read_by_solve(stage, kernel));
  };
  std::map<std::string, int> reach;
  const auto note = [&](const std::vector<Signature::Read>& reads, int grow) {
    for (const Signature::Read& read : reads) {
      int width = 0;
      for (std::size_t axis = 0; axis < axes.size(); ++axis) {
        if (axes[axis] == Topology::bounded) width = std::max(width, read.halo[axis]);
      }
      reach[read.field] = std::max(reach[read.field], grow + width);
    }
  };
  note(signature(stage.kernel).reads, 0);
  std::vector<int> grows(stage.before.size(), 0);
  for (std::size_t i = stage.before.size(); i-- > 0;) {
    if (const Kernel* kernel = std::get_if<Kernel>(&stage.before[i]); kernel && has_walls && !is_filled(*kernel)) {
      for (const Store& store : kernel->stores) grows[i] = std::max(grows[i], reach[store.field]);
    }
    note(reads_of(stage.before[i]), grows[i]);
  }
  return grows;
}

int widest_read(const std::vector<Stage>& stages, const std::vector<Topology>& axes) {
  int width = 0;
  for (const Stage& stage : stages) {
    for (const Signature::Read& read : signature(stage.kernel).reads) width = std::max(width, width_of(read));
    const std::vector<int> grows = grows_of(stage, axes);
    for (std::size_t i = 0; i < grows.size(); ++i) {
      for (const Signature::Read& read : reads_of(stage.before[i])) width = std::max(width, grows[i] + width_of(read));
      width = std::max(width, width_inside(stage.before[i]));
    }
  }
  return width;
}

/// The fields that a stage writes, by the names that they have at the end of the program.
std::vector<std::string> known_outside(const Stage& stage) {
  std::vector<std::string> fields = signature(stage.kernel).writes;
  if (!stage.block) return fields;
  std::vector<std::string> results;
  for (const LoopCarried& carry : stage.block->carries) {
    if (contains(fields, carry.next)) results.push_back(carry.result);
  }
  return results;
}

/// Fields that the passes of a block write or carry.
std::set<std::string> fields_of_passes(const std::vector<Stage>& stages, const StageBlock* block) {
  std::set<std::string> fields;
  for (const LoopCarried& carry : block->carries) fields.insert({carry.state, carry.next});
  for (const Stage& stage : stages) {
    if (stage.block.get() != block) continue;
    for (const std::string& field : signature(stage.kernel).writes) fields.insert(field);
  }
  return fields;
}

/// Redirects additions to a program into its current block. A block has halo rules of its own: of fields filled outside
/// it sees the interior only.
class BlockScope {
 public:
  BlockScope(const std::vector<Stage>& stages, Program& program, std::set<std::string>& grown, Walls& walls)
      : stages_(stages), program_(program), grown_(grown), walls_(walls) {}

  /// Leaves the current block unless it is `block`, and enters `block`; null: none.
  void enter(const std::shared_ptr<const StageBlock>& block) {
    if (block == block_) return;
    if (block_) leave();
    block_ = block;
    if (!block_) return;
    own_ = fields_of_passes(stages_, block_.get());
    outer_body_ = std::exchange(program_.body, {});
    outer_halos_ = std::exchange(program_.halos, {});
    outer_grown_ = std::exchange(grown_, {});
    outer_walls_ = walls_.forget();
  }

  /// Whether the field comes from outside the block: its value on a wall belongs to the time of the step, not of the
  /// pass.
  bool is_from_outside(const std::string& field) const { return block_ && !own_.contains(field); }
  /// Whether a block may have filled the field.
  bool may_spoil(const std::string& field) const { return filled_inside_.contains(field); }

 private:
  void leave() {
    for (const HaloRule& rule : program_.halos) filled_inside_.insert(rule.fill.field);
    std::vector<Statement> body = std::exchange(program_.body, std::move(outer_body_));
    std::vector<HaloRule> halos = std::exchange(program_.halos, std::move(outer_halos_));
    program_.body.push_back(statement_of(*block_, std::move(body), std::move(halos)));
    grown_ = std::move(outer_grown_);
    walls_.remember(std::move(outer_walls_));
  }

  static Statement statement_of(const StageBlock& block, std::vector<Statement> body, std::vector<HaloRule> halos) {
    if (block.solve) {
      Solve solve = *block.solve;
      solve.body = std::move(body);
      solve.halos = std::move(halos);
      return solve;
    }
    Repeat repeat{block.count, std::move(body), block.carries};
    repeat.counter.name = block.counter;
    repeat.halos = std::move(halos);
    return repeat;
  }

  const std::vector<Stage>& stages_;
  Program& program_;
  std::set<std::string>& grown_;
  Walls& walls_;
  std::shared_ptr<const StageBlock> block_;
  std::set<std::string> own_, filled_inside_;
  std::vector<Statement> outer_body_;
  std::vector<HaloRule> outer_halos_;
  std::set<std::string> outer_grown_;
  Walls::Stored outer_walls_;
};

}  // namespace

std::vector<Signature::Read> reads_of(const Stage& stage) {
  std::vector<Signature::Read> reads = signature(stage.kernel).reads;
  for (const Prerequisite& preparation : stage.before) {
    const std::vector<Signature::Read> more = reads_of(preparation);
    reads.insert(reads.end(), more.begin(), more.end());
  }
  return reads;
}

Lowering::Lowering(const model::Problem& problem) : problem_(problem), placements_(problem) {
  for (const BoundName& known : bound_names) names_.reserve(std::string(known.name));
  for (const std::string_view name : wave_names) names_.reserve(std::string(name));
  names_.reserve("loss");
  for (const model::Parameter& parameter : problem.params) names_.reserve(parameter.name);
  for (const model::Coefficient& coefficient : problem.coefficients) names_.reserve(coefficient.name);
  for (const model::Quantity& observable : problem.observables) names_.reserve(observable.name);
  for (const model::OutputField& shown : problem.shown) names_.reserve(shown.name);
  for (const network::Network& network : problem.networks) names_.reserve(network.name);
  for (const model::State& state : problem.states) {
    names_.reserve(state.name);
    state_of_[state.name] = state.name;
  }
  if (!problem.task) return;
  for (const model::Datum& datum : problem.task->data) names_.reserve(datum.name);
  for (const model::Test& test : problem.task->tests) names_.reserve(test.quantity.name);
}

bool Lowering::stands_for_state(const std::string& field) const {
  const auto found = state_of_.find(field);
  const model::State* state = found == state_of_.end() ? nullptr : problem_.find_state(found->second);
  return state != nullptr && state->history_of.empty();
}

std::string Lowering::state_of(const std::string& field) const {
  const auto found = state_of_.find(field);
  return found == state_of_.end() ? "" : found->second;
}

std::string Lowering::field_beside(const std::string& state, const std::string& suffix) {
  const std::string field = names_.fresh(state + "_" + suffix);
  state_of_[field] = state;
  return field;
}

Discretiser Lowering::discretiser(Environment reading, const std::vector<Let>& taken) const {
  const model::Scheme scheme = model::with_differences(problem_.scheme);
  NameSupply names = names_;
  for (const Let& let : taken) names.reserve(let.name);
  return {scheme, std::move(names), rank(), std::move(reading), placements_};
}

Kernel Lowering::kernel(const std::string& name) const {
  Kernel kernel;
  kernel.name = name;
  kernel.rank = rank();
  return kernel;
}

Stage Lowering::stage(Kernel kernel, const Discretiser& at_point, Expr time) {
  kernel.lets = at_point.lets();
  return {std::move(kernel),         std::move(time), at_point.preparations(),
          at_point.reading().fields, nullptr,         at_point.reading()};
}

/// The boundary of a field without a boundary of its own.
std::vector<AxisBoundary> Lowering::plain_boundary() const {
  std::vector<AxisBoundary> boundary;
  for (const model::Axis& axis : problem_.axes) {
    const bool periodic = axis.topology == Topology::periodic;
    const Side side = periodic ? Side{} : Side{SideKind::zero_gradient};
    boundary.push_back({axis.topology, side, side});
  }
  return boundary;
}

/// The boundary of a field that is not a state.
std::vector<AxisBoundary> Lowering::boundary_of(const std::string& field) const {
  std::vector<AxisBoundary> boundary = plain_boundary();
  const auto placed = placed_.find(field);
  for (std::size_t axis = 0; placed != placed_.end() && axis < boundary.size(); ++axis) {
    if (!placed->second[axis] || boundary[axis].topology == Topology::periodic) continue;
    boundary[axis].low = {SideKind::linear, 0.0, 0.0, 0.0, true};
    boundary[axis].high = {SideKind::outflow, 0.0, 0.0, 0.0, true};
  }
  const model::Coefficient* coefficient = problem_.find_coefficient(field);
  for (std::size_t axis = 0; coefficient && axis < boundary.size(); ++axis) {
    if (model::goes_on_beyond(problem_, *coefficient, axis, true)) boundary[axis].low.kind = SideKind::linear;
    if (model::goes_on_beyond(problem_, *coefficient, axis, false)) boundary[axis].high.kind = SideKind::linear;
  }
  for (std::size_t axis = 0; coefficient && axis < boundary.size(); ++axis) {
    const SideKind kind = coefficient->turns_round ? SideKind::opposite_pole : SideKind::pole;
    if (coefficient->at_poles[axis].low) boundary[axis].low = {kind};
    if (coefficient->at_poles[axis].high) boundary[axis].high = {kind};
  }
  if (coefficient && coefficient->walls) {
    AxisBoundary& across = boundary[static_cast<std::size_t>(coefficient->walls->axis)];
    across.low = {SideKind::value, coefficient->walls->low};
    across.high = {SideKind::value, coefficient->walls->high};
  }
  return boundary;
}

/// The state whose boundary applies to `field`; also for data of the same field from another scene's run.
const model::State* Lowering::state_beyond_walls(const std::string& field) const {
  const auto found = state_of_.find(field);
  if (found != state_of_.end()) return problem_.find_state(found->second);
  if (!problem_.task) return nullptr;
  const auto datum = std::ranges::find(problem_.task->data, field, &model::Datum::name);
  if (datum == problem_.task->data.end() || datum->series) return nullptr;
  const model::State* state = problem_.find_state(datum->field);
  const bool needs_others = state != nullptr && (model::radiates(*state) ||  // its rate is not known here
                                                 model::has_wall_formula(problem_, state->boundary));
  return needs_others ? nullptr : state;
}

/// The state of `field`, if its values lie on walls; nullptr for histories of time schemes, which have no other reader.
const model::State* Lowering::state_on_walls(const std::string& field) const {
  const auto found = state_of_.find(field);
  const model::State* state = found == state_of_.end() ? nullptr : problem_.find_state(found->second);
  if (!state || !state->history_of.empty()) return nullptr;
  for (std::size_t axis = 0; axis < problem_.axes.size(); ++axis) {
    if (state->placement[axis] && problem_.axes[axis].topology == Topology::bounded) return state;
  }
  return nullptr;
}

std::vector<Stage> Lowering::with_wall_values(std::vector<Stage> stages, const Expr& time_of_results) const {
  const auto time_of = [&](const std::string& field, std::size_t after) {
    for (std::size_t later = after + 1; later < stages.size(); ++later) {
      if (stages[later].block != stages[after].block) continue;  // outside a block its fields are results
      const std::vector<Signature::Read> reads = reads_of(stages[later]);
      const auto is_of_field = [&](const Signature::Read& read) { return read.field == field; };
      if (std::any_of(reads.begin(), reads.end(), is_of_field)) return stages[later].time;
    }
    return stages[after].block ? stages[after].block->end : time_of_results;
  };
  for (std::size_t i = 0; i < stages.size(); ++i) {
    for (Store& store : stages[i].kernel.stores) {
      const model::State* state = state_on_walls(store.field);
      if (state) store.value = with_wall_value(*state, problem_, store.value, time_of(store.field, i));
    }
  }
  return stages;
}

/// Whether the read needs no fill, as the kernel has stored the value on walls too.
bool Lowering::has_value_on_walls(const Signature::Read& read) const {
  const model::State* state = state_on_walls(read.field);
  return state != nullptr && !is_read_beyond_the_cell(read) && !is_derived_on_wall(*state, problem_);
}

bool Lowering::needs_fill(const Signature::Read& read) const {
  return !is_coordinate(read.field) && (is_read_beyond_the_cell(read) || state_on_walls(read.field));
}

/// In a block a wall value from outside belongs to the step, not to the pass, and no fill replaces it.
HaloRule Lowering::rule_for(const std::string& field, std::vector<AxisBoundary> boundary, bool is_from_outside) const {
  HaloRule rule = rule_of_fill({field, std::move(boundary)});
  const model::State* state = state_on_walls(field);
  if (state && is_from_outside) rule.need = FillNeed::beyond;
  if (state && is_derived_on_wall(*state, problem_)) rule.need = FillNeed::results;
  return rule;
}

/// The program under construction.
struct Lowering::KernelDraft {
  Module& module;
  Program& program;
  Walls& walls;
  const BlockScope& scope;
  std::set<std::string>& grown;                // fields that a stage computes as far beyond walls as it reads them
  std::map<std::string, model::State> solved;  // the unknowns, with their boundaries
};

/// A field has the boundary of its own time, that of the first stage which reads it: u that of t, in later stages too.
void Lowering::add_halos(const std::vector<Signature::Read>& reads, const Expr& time, int grow,
                         const FieldsOfStates& at, KernelDraft& draft) const {
  for (Signature::Read read : reads) {
    if (grow > 0) read.halo[0] += grow;
    const bool is_outside = draft.scope.is_from_outside(read.field);
    const bool is_stated = draft.grown.contains(read.field) || has_rule(draft.program.halos, read.field);
    if (is_stated || !needs_fill(read) || (is_outside && has_value_on_walls(read))) continue;
    const auto unknown = draft.solved.find(read.field);
    const model::State* const state = unknown != draft.solved.end() ? &unknown->second : state_beyond_walls(read.field);
    std::vector<AxisBoundary> boundary = boundary_of(read.field);
    if (state != nullptr) boundary = draft.walls.boundary(*state, time, draft.module, draft.program, at);
    HaloRule rule = rule_for(read.field, std::move(boundary), is_outside);
    if (state != nullptr) rule.fill.written.field = state->name;
    draft.program.halos.push_back(std::move(rule));
  }
}

void Lowering::add_preparation(const Prerequisite& preparation, const Stage& stage, int grow,
                               KernelDraft& draft) const {
  Program& program = draft.program;
  add_halos(reads_of(preparation), stage.time, grow, stage.at, draft);
  match(
      preparation,
      [&](const Kernel& kernel) {
        program.body.push_back(Run{add_kernel(draft.module, kernel), grow});
        for (const Store& store : kernel.stores) {
          if (grow > 0) draft.grown.insert(store.field);
        }
      },
      [&](const Reduce& reduce) { program.body.push_back(reduce); },
      [&](const NetworkCall& network_call) {
        program.body.push_back(network_call);
        add_networks(draft.module, {*problem_.find_network(network_call.network)});
      },
      [&](const Transform& transform) { program.body.push_back(transform); },
      [&](const PreparedSolve& solve) {
        draft.solved[solve.result()] = solve.state;
        if (solve.preconditioner) add_networks(draft.module, {*problem_.find_network(solve.preconditioner->network)});
        const auto add = [&](const auto& reads) { add_halos(reads, stage.time, 0, stage.at, draft); };
        add_solve(solve, stage.time, add, draft.walls, draft.module, program);
      });
}

namespace {

/// Stores values that a stage needs at many points in fields before it.
void store_values(Stage& stage, const std::vector<Topology>& axes) {
  StoredValues stored = with_stored_values(stage.kernel, axes);
  stage.kernel = std::move(stored.kernel);
  std::ranges::move(stored.before, std::back_inserter(stage.before));
}

}  // namespace

Program& Lowering::add_program(Module& module, const std::string& name, const std::vector<Stage>& given,
                               const Expr& time_of_results) const {
  Program program;
  program.name = name;
  for (const model::Axis& axis : problem_.axes) program.axes.push_back(axis.topology);
  std::vector<Stage> stages = with_wall_values(given, time_of_results);
  for (Stage& stage : stages) store_values(stage, program.axes);
  stages = with_own_names(std::move(stages), names_, state_of_);
  const auto beyond = [this](const std::string& coefficient) { return boundary_of(coefficient); };
  Walls walls(problem_, names_, widest_read(stages, program.axes), beyond);
  std::set<std::string> grown;
  BlockScope scope(stages, program, grown, walls);
  KernelDraft draft{module, program, walls, scope, grown, {}};
  for (const Stage& stage : stages) {
    scope.enter(stage.block);
    const std::vector<int> grows = grows_of(stage, program.axes);
    for (std::size_t i = 0; i < stage.before.size(); ++i) add_preparation(stage.before[i], stage, grows[i], draft);
    add_halos(signature(stage.kernel).reads, stage.time, 0, stage.at, draft);
    if (!is_idle(stage.kernel)) program.body.push_back(Run{add_kernel(module, stage.kernel)});
  }
  scope.enter(nullptr);
  std::vector<Signature::Read> results;
  for (const Stage& stage : stages) {
    for (const std::string& field : known_outside(stage)) {
      const model::State* state = state_on_walls(field);
      if (state && (is_derived_on_wall(*state, problem_) || scope.may_spoil(field)))
        results.push_back({field, {}, false});
    }
  }
  add_halos(results, time_of_results, 0, {}, draft);
  module.programs.push_back(std::move(program));
  return module.programs.back();
}

}  // namespace dpde::stencil
