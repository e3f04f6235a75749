// SPDX-License-Identifier: Apache-2.0
// Common parts of all programs of a problem: names, boundaries, and the construction of a program from a sequence of
// kernels. Each field that is read at offsets or interpolated, or that lies on walls, gets a HaloRule, from which
// place_fills (passes/place_fills.h) makes the fills.
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

/// A block of stages: the passes of a repeat, or the block of a solve.
struct StageBlock {
  int count = 1;
  std::string counter = {};
  std::vector<LoopCarried> carries = {};
  Expr end;  // the time at the end of a pass
  std::optional<Solve> solve = std::nullopt;
};

/// One kernel of a program, the statements before it, and the time of the fields that they read (for boundary values
/// that vary in time).
struct Stage {
  Kernel kernel;
  Expr time;
  std::vector<Prerequisite> before;
  FieldsOfStates at = {};                             // the fields that it reads instead of states
  std::shared_ptr<const StageBlock> block = nullptr;  // its block, shared by all stages of the block
  std::optional<Environment> reading = std::nullopt;  // the environment, if it evaluates formulas of the problem
};
/// All reads of a stage.
std::vector<Signature::Read> reads_of(const Stage& stage);

class Lowering {
 public:
  explicit Lowering(const model::Problem& problem);

  const model::Problem& problem() const { return problem_; }
  int rank() const { return static_cast<int>(problem_.axes.size()); }

  /// A new field for a state, such as u_next or u_1, with the state's boundary.
  std::string field_beside(const std::string& state, const std::string& suffix);
  /// Whether the field is a state, or a field for one, that is not a history of a time scheme.
  bool stands_for_state(const std::string& field) const;
  /// The state itself for a state, the state of a field for one; "" for other fields.
  std::string state_of(const std::string& field) const;
  /// A new field without a boundary, such as u_exact.
  std::string fresh_field(const std::string& wish) { return names_.fresh(wish); }
  /// A new field at `placement`. It has no point on low walls: there it is extrapolated linearly.
  std::string fresh_field_at(const std::string& wish, const model::Placement& placement) {
    return placed_.emplace(names_.fresh(wish), placement).first->first;
  }

  /// With semi-Lagrangian transport, which is not a difference, a remaining advect is central(2). Lets get other names
  /// than those of `taken`.
  Discretiser discretiser(Environment reading = {}, const std::vector<Let>& taken = {}) const;

  Kernel kernel(const std::string& name) const;
  /// The stage of `kernel` with the lets and preparations of `at_point`; it reads the fields at `time`.
  static Stage stage(Kernel kernel, const Discretiser& at_point, Expr time = Environment().time);
  /// Adds the kernels and the program that runs them; the caller adds swaps and keeps, and then has fills placed.
  /// For a state that lies on walls the kernels store the boundary value there: at the time of the stage that reads it,
  /// else at that of the results.
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
  std::map<std::string, std::string> state_of_;     // the states, and the fields for them
  std::map<std::string, model::Placement> placed_;  // fields without a boundary that have a placement
};

}  // namespace dpde::stencil
