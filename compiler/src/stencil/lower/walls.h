// SPDX-License-Identifier: Apache-2.0
// Boundaries of the states of one program. Values that are constant along a wall are part of the halo rule. Values that
// vary along it, or depend on control variables, are stored in a field by a kernel, so that they are differentiated
// as a kernel is.
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

/// `value` of a state, but at points on a high wall the boundary's value at `time`, if the condition is a value.
Expr with_wall_value(const model::State& state, const model::Problem& problem, const Expr& value, const Expr& time);

/// Whether values of the state on a high wall are computed from values next to them: then only a fill can set them.
bool is_derived_on_wall(const model::State& state, const model::Problem& problem);

/// One offset for each axis on whose high wall the boundary gives the stored values of the state; it leads from the
/// wall outwards. Open ends are excluded, as their values are unknowns.
std::vector<Offset> known_on_walls(const model::State& state, const model::Problem& problem);

class Walls {
 public:
  using BoundaryOf = std::function<std::vector<AxisBoundary>(const std::string& coefficient)>;
  /// `width`: number of halo cells that the program reads. Names of fields are taken from `names`. `boundary_of`:
  /// boundaries of coefficients for which the program has no rule.
  Walls(const model::Problem& problem, NameSupply names, int width, BoundaryOf boundary_of)
      : problem_(problem), names_(std::move(names)), width_(width), boundary_of_(std::move(boundary_of)) {}

  using Stored = std::vector<std::pair<Expr, std::string>>;  // values, and the fields that hold them
  /// Removes, or restores, the list of stored values.
  Stored forget() { return std::exchange(stored_, {}); }
  void remember(Stored stored) { stored_ = std::move(stored); }
  /// The boundary for a fill of `state` at `time`; adds the kernels for its fields to the module and the program.
  /// `at`: the fields that are read instead of states; slopes may depend on their rates.
  std::vector<AxisBoundary> boundary(const model::State& state, const Expr& time, Module& module, Program& program,
                                     const FieldsOfStates& at = {});

 private:
  std::string stored(const std::string& state, const Expr& value, const Origin& origin, int grow, Module& module,
                     Program& program);
  /// A field whose halo has the value on the wall of a formula of states and coefficients.
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
