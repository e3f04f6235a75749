// SPDX-License-Identifier: Apache-2.0
// What the programs of one problem share: names, boundaries, and the rule by which a sequence of kernels becomes a
// program: what is read at offsets or interpolated, or lies on walls, has a rule by which it goes on; place_fills
// (passes/place_fills.h) makes the fills of that.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "model/model.h"
#include "stencil/build.h"
#include "stencil/lower/walls.h"
#include "stencil/space/discretise.h"
#include "stencil/stencil.h"
#include "support/names/name_supply.h"

namespace dpde::stencil {

/// Stages that are the passes of a repeat, or the block of a solve.
struct StageBlock {
  int count = 1;
  std::string counter = {};
  std::vector<LoopCarried> carries = {};
  Expr end;  // the time where a pass ends
  std::optional<Solve> solve = std::nullopt;
};

/// One kernel of a program, what is done before it, and the time of the fields that these read (for boundary values
/// that vary).
struct Stage {
  Kernel kernel;
  Expr time;
  std::vector<Prerequisite> before;
  FieldsOfStates at = {};                             // what it reads in the place of states
  std::shared_ptr<const StageBlock> block = nullptr;  // which it stands in with the stages that have the same
  std::optional<Environment> reading = std::nullopt;  // when formulas of a problem stand in it: what they read
};
/// All that a stage reads.
std::vector<Signature::Read> reads_of(const Stage& stage);

class Lowering {
 public:
  explicit Lowering(const model::Problem& problem);

  const model::Problem& problem() const { return problem_; }
  int rank() const { return static_cast<int>(problem_.axes.size()); }

  /// A new field beside a state with the state's boundary, as u_next or u_1.
  std::string field_beside(const std::string& state, const std::string& suffix);
  /// Of a state that is no memory of a time scheme: itself, or beside it.
  bool stands_for_state(const std::string& field) const;
  /// The state that a field is, or is beside; "" of others.
  std::string state_of(const std::string& field) const;
  /// A new field with no boundary of its own, as u_exact.
  std::string fresh_field(const std::string& wish) { return names_.fresh(wish); }
  /// One that lies where `placement` says. On low walls, which have no point of it, it is what its straight line is.
  std::string fresh_field_at(const std::string& wish, const model::Placement& placement) {
    return placed_.emplace(names_.fresh(wish), placement).first->first;
  }

  /// Transport along the flow is no difference: where it was chosen, an advect that is left is central(2).
  /// Lets get other names than those of `taken`.
  Discretiser discretiser(Environment reading = {}, const std::vector<Let>& taken = {}) const;

  Kernel kernel(const std::string& name) const;
  /// `kernel` with the lets of `at_point`, and behind what they need; it reads the fields at `time`.
  static Stage stage(Kernel kernel, const Discretiser& at_point, Expr time = Environment().time);
  /// Adds the kernels and the program that runs them; swaps and keeps are the caller's, who has its fills placed then.
  /// What is stored for a state that lies on walls is, there, what the boundary says: at the time of the stage that
  /// reads it, else at that of the results.
  Program& add_program(Module& module, const std::string& name, const std::vector<Stage>& stages,
                       const Expr& time_of_results = Environment().time) const;
  model::Placement placement_of(const std::string& state) const { return placements_.of(state); }

 private:
  using StateHalos = std::function<void(const std::vector<Signature::Read>&)>;
  struct KernelDraft;
  void add_halos(const std::vector<Signature::Read>& reads, const Expr& time, int grow, const FieldsOfStates& at,
                 KernelDraft& draft) const;
  void add_preparation(const Prerequisite& preparation, const Stage& stage, int grow, KernelDraft& draft) const;
  void add_solve(PreparedSolve solve, const Expr& time, const StateHalos& state_halos, Walls& walls, Module& module,
                 Program& program) const;
  std::string keep_wall_values(PreparedSolve& solve, Module& module, Program& block) const;
  void add_walls_of(PreparedSolve& solve, const std::vector<AxisBoundary>& boundary, const StateHalos& state_halos,
                    Module& module, Program& program) const;
  const model::State* state_on_walls(const std::string& field) const;
  std::vector<Stage> with_wall_values(std::vector<Stage> stages, const Expr& time_of_results) const;
  std::vector<AxisBoundary> plain_boundary() const;
  bool has_value_on_walls(const Signature::Read& read) const;
  bool needs_fill(const Signature::Read& read) const;
  HaloRule rule_for(const std::string& field, std::vector<AxisBoundary> boundary, bool is_from_outside) const;
  std::vector<AxisBoundary> boundary_of(const std::string& field) const;
  const model::State* state_beyond_walls(const std::string& field) const;

  const model::Problem& problem_;
  model::Placements placements_;
  NameSupply names_;
  std::map<std::string, std::string> state_of_;     // the states, and the fields beside them
  std::map<std::string, model::Placement> placed_;  // fields without a boundary that lie somewhere
};

}  // namespace dpde::stencil
