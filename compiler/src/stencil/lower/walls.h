// SPDX-License-Identifier: Apache-2.0
// Boundaries of the states of one program. Values that are the same along a wall stand in the rule of the halo. Those
// that vary along it, or by unknowns, are stored in a field by a kernel of their own before it is needed, so that the
// derivative of a kernel is all they need.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "model/model.h"
#include "stencil/space/discretise.h"
#include "stencil/stencil.h"
#include "support/names/name_supply.h"

namespace dpde::stencil {

/// `value` of a state, but at its points on a high wall the value that its boundary has there, where it is one, at
/// `time`.
Expr with_wall_value(const model::State& state, const model::Problem& problem, const Expr& value, const Expr& time);

/// Whether values of the state on a high wall, which are stored, follow from those beside them: then only a fill can
/// set them.
bool is_derived_on_wall(const model::State& state, const model::Problem& problem);

/// One offset an axis along which values of the state on the high wall are stored and known by its boundary: from them
/// it leads out. An open end moves its own.
std::vector<Offset> known_on_walls(const model::State& state, const model::Problem& problem);

class Walls {
 public:
  using BoundaryOf = std::function<std::vector<AxisBoundary>(const std::string& coefficient)>;
  /// `width`: how many halo cells the program reads. Fields take names that `names` does not know. `boundary_of`: how
  /// coefficients go on, where the program does not say otherwise.
  Walls(const model::Problem& problem, NameSupply names, int width, BoundaryOf boundary_of)
      : problem_(problem), names_(std::move(names)), width_(width), boundary_of_(std::move(boundary_of)) {}

  using Stored = std::vector<std::pair<Expr, std::string>>;  // values, and the fields that hold them
  /// Makes it forget, or know again, what it has stored.
  Stored forget() { return std::exchange(stored_, {}); }
  void remember(Stored stored) { stored_ = std::move(stored); }
  /// What a fill of `state` at `time` needs; what it reads is added to the module and the program.
  /// `at`: what is read in the place of states, of whose rates slopes may follow.
  std::vector<AxisBoundary> boundary(const model::State& state, const Expr& time, Module& module, Program& program,
                                     const FieldsOfStates& at = {});

 private:
  std::string stored(const std::string& state, const Expr& value, const Origin& origin, int grow, Module& module,
                     Program& program);
  /// A field that has at halo cells what a formula of states and coefficients gives on the wall.
  Expr from_beside(const model::State& state, int axis, bool is_low, const Expr& time, Module& module, Program& program,
                   const FieldsOfStates& at);
  std::string rate_field(const model::State& state, const FieldsOfStates& at) const;
  std::string filled_rate(const model::State& state, const Expr& time, Module& module, Program& program,
                          const FieldsOfStates& at);
  bool varies(const model::Expr& value) const;

  const model::Problem& problem_;
  NameSupply names_;
  const int width_;
  BoundaryOf boundary_of_;
  Stored stored_;
};

}  // namespace dpde::stencil
