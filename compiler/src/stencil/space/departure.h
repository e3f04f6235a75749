// SPDX-License-Identifier: Apache-2.0
// Where the flow brings a state from, and what the state is there.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/model.h"
#include "stencil/space/discretise.h"

namespace dpde::stencil {

/// -advect(v, state) in its equation, or nullptr.
const model::Advect* find_transport(const model::Expr& rate);

/// The least and the greatest of the corners of a cell.
struct Bounds {
  Expr least, greatest;
};

/// Of one state, at the points where it lies. Along axes on whose walls it lies, ways end there: between the low wall
/// and the first point inside it is linear like between points, from the value on the wall, which a fill has set.
class Departure {
 public:
  Departure(const model::Problem& problem, const model::State& state, Discretiser& at_point)
      : problem_(problem), state_(state), at_point_(at_point) {}

  /// The way of the flow in a step, backwards or forwards, in cells.
  std::vector<Expr> way(const model::Advect& advect, bool backwards);
  /// The same with a name.
  std::vector<Expr> shared_way(const std::string& wish, std::vector<Expr> way);
  /// `field`, which lies where the state does, at the end of the way.
  Expr taken(const std::string& field, const std::vector<Expr>& way, InterpolationBasis along);
  /// Of the cell that the way leads to.
  Bounds bounds(const std::string& field, const std::vector<Expr>& way);
  /// `value` where neither way leads beyond a wall, else 0.
  Expr within_walls(Expr value, const std::vector<Expr>& back, const std::vector<Expr>& forth);

 private:
  bool lies_on_walls(std::size_t axis) const;
  /// The coordinate of the point.
  Expr place(std::size_t axis) const;
  /// The way, ended on the walls that the state lies on.
  std::vector<Expr> ended(std::vector<Expr> way);
  Expr between(Interp read, std::size_t axis);
  Expr cubic_between(Interp read, std::size_t axis);

  const model::Problem& problem_;
  const model::State& state_;
  Discretiser& at_point_;
};

}  // namespace dpde::stencil
