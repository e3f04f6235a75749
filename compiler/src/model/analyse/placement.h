// SPDX-License-Identifier: Apache-2.0
// Placements of expressions on staggered grids. A field has the placement of its declaration. Derivatives of order 1
// move values between centres and faces, and `interpolate` moves them anywhere; every other mixture of placements is an
// error. Coordinates and numbers are known everywhere.
//
// Placements are assigned top down, from the left side of the equation. A derivative of order 1 takes its operand at
// the other placement along its axis if possible (staggered difference), else at the same one (central difference). An
// expression whose fields all have the required placement is discretised as on unstaggered grids. advect(v, f)
// interpolates v to the placement of f. A reduction is known everywhere along its own axes; along the others it has the
// placement of its operand. The result of an operator with a given adjoint is a field with the placement that fits its
// body. The output of a network lies where all its arguments lie. For vectors on faces or edges it is computed cell by
// cell, and each component has the placement of the argument's component.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/model.h"

namespace dpde::model {

/// "cell centres", "faces across x", "edges along x", "nodes", ...
std::string describe(const Placement& placement, int axes);
Placement toggled(Placement placement, int axis);
/// The axes with the points of a placement as their cell centres.
std::vector<Axis> axes_at(std::vector<Axis> axes, const Placement& placement);

class Placements {
 public:
  /// The part of an expression that prevents evaluation at `wanted`.
  struct Mistake {
    Expr part;
    std::optional<Placement> has;  // nullopt: the part interpolates an expression without placement
    Placement wanted;
  };

  Placements() = default;  // nothing is staggered
  explicit Placements(const Problem& problem);

  bool is_staggered() const { return !staggered_.empty(); }
  Placement of(const std::string& field) const;
  /// Whether `e` is a datum with one number per state.
  bool is_series(const Expr& e) const;
  /// The common placement of all fields of `e` outside interpolations; nullopt if there are none or several.
  std::optional<Placement> only(const Expr& e) const;
  bool can_be_at(const Expr& e, const Placement& wanted) const { return !misplaced(e, wanted); }
  /// The placement of `e` without interpolation; nullopt if it has none, or its parts do not fit together.
  std::optional<Placement> natural(const Expr& e) const;

  /// Placements of the names in an operator's body, parameters and seeds, if its component is required at `wanted`.
  Placements inside(const Apply& apply, const Placement& wanted) const;
  /// The part of an operator's body or formulas that prevents evaluation of its component at `wanted`.
  std::optional<Mistake> find_mistake_inside(const Apply& apply, const Placement& wanted) const;

  /// Placements of a network's arguments and result.
  struct OfCall {
    std::vector<Placement> arguments;
    Placement result{};
    bool is_cell_by_cell = false;  // some argument is a vector on faces or edges, the others lie at the centres
    bool fits = true;              // each argument can be evaluated at its required placement
  };
  /// For a result required at `wanted`, which decides only for calls of numbers and coordinates. If the arguments have
  /// no common placement, the result names the required one or the centres, and does not fit.
  OfCall places_of(const NetworkCall& call, const Placement& wanted) const;

  /// Placement of a reduction's operand for a result at `wanted`. Along the reduced axes any placement that fits the
  /// operand will do. nullopt: none fits.
  std::optional<Placement> operand_placement(const Reduce& reduce, const Placement& wanted) const;

  std::optional<Mistake> find_mistake(const Expr& e, const Placement& wanted) const;
  /// The same without a required placement, as for operands of sums; nullopt if some placement fits.
  std::optional<Mistake> find_mistake(const Expr& e) const;

 private:
  enum class Fields { none, one, several };
  void collect(const Expr& e, Fields& found, Placement& placement) const;
  std::vector<Placement> candidates(const Expr& e) const;
  void add_candidates(const Expr& e, std::vector<Placement>& found) const;
  std::optional<Mistake> misplaced(const Expr& e, const Placement& wanted) const;
  std::optional<Mistake> misplaced(const Expr& e) const;
  std::optional<Mistake> misplaced_call(const Expr& e, const NetworkCall& call, const Placement& wanted) const;
  std::optional<Mistake> bad_interpolation(const Expr& e) const;
  OfCall laid_out(const NetworkCall& call, const Placement& wanted) const;
  std::optional<OfCall> cell_by_cell(const NetworkCall& call) const;

  /// Nested networks ask for each call many times while the outermost one is processed. The cache is cleared
  /// afterwards, as other expressions may get the same addresses.
  struct KnownCalls {
    std::map<std::pair<const NetworkCall*, Placement>, OfCall> calls = {};
    int depth = 0;
    KnownCalls() = default;
    KnownCalls(const KnownCalls& /*other*/) {}
    KnownCalls& operator=(const KnownCalls& /*other*/) { return *this; }
  };
  mutable KnownCalls known_;

  bool holds_number_argument(const Expr& e) const;

  std::map<std::string, Placement> staggered_;  // fields that are not at centres; in operators all fields
  enum class Anywhere { series, argument };     // data with one number per state; uniform arguments of operators
  std::map<std::string, Anywhere> anywhere_;
  bool has_waves_ = false;  // Fourier derivatives: all fields and derivatives lie at centres
};

}  // namespace dpde::model
