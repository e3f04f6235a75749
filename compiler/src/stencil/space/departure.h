// SPDX-License-Identifier: Apache-2.0
// Departure points of semi-Lagrangian transport, and the values of states there.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/model.h"
#include "stencil/space/discretise.h"

namespace dpde::stencil {

/// -advect(v, state) in its equation, or nullptr.
const model::Advect* find_transport(const model::Expr& rate);

/// The least and the greatest value at the corners of a cell.
struct Bounds {
  Expr least, greatest;
};

/// Departure points of one state, for the points where it lies. Along an axis on whose walls the state lies,
/// displacements end at the walls. Between the low wall and the first point inside, the state is linear as between
/// other points, from the value on the wall that a fill has set.
class Departure {
 public:
  Departure(const model::Problem& problem, const model::State& state, Discretiser& at_point)
      : problem_(problem), state_(state), at_point_(at_point) {}

  /// Displacement by the flow in a step, backwards or forwards, in cells per axis.
  std::vector<Expr> way(const model::Advect& advect, bool backwards);
  /// Stores the displacement in lets.
  std::vector<Expr> shared_way(const std::string& wish, std::vector<Expr> way);
  /// Value of `field`, which lies where the state does, at the end of the displacement.
  Expr taken(const std::string& field, const std::vector<Expr>& way, InterpolationBasis along);
  /// Bounds of the values in the cell at the end of the displacement.
  Bounds bounds(const std::string& field, const std::vector<Expr>& way);
  /// `value` where neither displacement leads beyond a wall, else 0.
  Expr within_walls(Expr value, const std::vector<Expr>& back, const std::vector<Expr>& forth);

 private:
  bool lies_on_walls(std::size_t axis) const;
  /// The coordinate of the point.
  Expr place(std::size_t axis) const;
  /// The displacement, limited to the walls that the state lies on.
  std::vector<Expr> ended(std::vector<Expr> way);
  Expr between(Interp read, std::size_t axis);
  Expr cubic_between(Interp read, std::size_t axis);

  const model::Problem& problem_;
  const model::State& state_;
  Discretiser& at_point_;
};

}  // namespace dpde::stencil
