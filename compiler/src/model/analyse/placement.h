// SPDX-License-Identifier: Apache-2.0
// Where expressions have their values on staggered grids. A field has one placement, that of its declaration. Values
// move by derivatives of order 1, which lead from centres to faces and back, and by `interpolate`; whatever else mixes
// placements is a mistake. Coordinates and numbers are known everywhere.
//
// From above an expression is asked for at the placement that the left side of the equation has. A derivative of order
// 1 along an axis then takes its operand at the other placement along that axis where that can be (the staggered
// difference), else at the same one (the central difference). What holds fields of a single placement, and is wanted
// there, is discretised as on grids without staggering. advect(v, f) interpolates v to where f is. A reduction is known
// everywhere along the axes it goes over, and along the others where its operand is. What an operator with an adjoint
// of its own makes is a field where its body fits. What a network makes lies where its arguments lie, all at one place;
// made of a vector on faces or edges, cell by cell, each component lies where that of the argument does.
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
/// The axes with a placement's points in the part of the cell centres.
std::vector<Axis> axes_at(std::vector<Axis> axes, const Placement& placement);

class Placements {
 public:
  /// The part of an expression that keeps it from being taken at `wanted`.
  struct Mistake {
    Expr part;
    std::optional<Placement> has;  // nullopt: the part is an interpolation of what has no placement
    Placement wanted;
  };

  Placements() = default;  // nothing is staggered
  explicit Placements(const Problem& problem);

  bool is_staggered() const { return !staggered_.empty(); }
  Placement of(const std::string& field) const;
  /// Whether `e` is a datum that is one number a state.
  bool is_series(const Expr& e) const;
  /// The placement of all fields of `e` that are not interpolated; nullopt where there are none or several.
  std::optional<Placement> only(const Expr& e) const;
  bool can_be_at(const Expr& e, const Placement& wanted) const { return !misplaced(e, wanted); }
  /// Where `e` is known without interpolating; nullopt where it has no placement of its own, or its parts do not fit.
  std::optional<Placement> natural(const Expr& e) const;

  /// What the names of an operator mean, parameters and seeds; its component is wanted at `wanted`.
  Placements inside(const Apply& apply, const Placement& wanted) const;
  /// The part of an operator's body or formulas that keeps its component from being taken at `wanted`.
  std::optional<Mistake> find_mistake_inside(const Apply& apply, const Placement& wanted) const;

  /// Where a network takes its arguments, and where its result lies.
  struct OfCall {
    std::vector<Placement> arguments;
    Placement result{};
    bool is_cell_by_cell = false;  // a vector on faces or edges beside what lies at the centres
    bool fits = true;              // each argument can be taken where it is wanted
  };
  /// With a result that is wanted at `wanted`, which decides for calls of numbers and coordinates alone. Arguments that
  /// fit nowhere together are asked for where that would be, or at the centres: a mistake of theirs.
  OfCall places_of(const NetworkCall& call, const Placement& wanted) const;

  /// Where the operand of a reduction is taken so that the result is known at `wanted`: along the axes that it goes
  /// over that is wherever the operand fits. nullopt: nowhere.
  std::optional<Placement> operand_placement(const Reduce& reduce, const Placement& wanted) const;

  std::optional<Mistake> find_mistake(const Expr& e, const Placement& wanted) const;
  /// The same for what is wanted nowhere in particular, as what is summed up; nullopt when it has a place.
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

  /// Of networks of networks each is asked for many times while the outermost one is laid out; afterwards nothing is
  /// known, since other expressions may come to lie at the same addresses.
  struct KnownCalls {
    std::map<std::pair<const NetworkCall*, Placement>, OfCall> calls = {};
    int depth = 0;
    KnownCalls() = default;
    KnownCalls(const KnownCalls& /*other*/) {}
    KnownCalls& operator=(const KnownCalls& /*other*/) { return *this; }
  };
  mutable KnownCalls known_;

  bool holds_number_argument(const Expr& e) const;

  std::map<std::string, Placement> staggered_;  // those that are not at centres; in operators all
  enum class Anywhere {
    series,
    argument
  };  // data that are one number a state; arguments that are the same at all points
  std::map<std::string, Anywhere> anywhere_;
  bool has_waves_ = false;  // derivatives by Fourier series lie where their operands do, and nothing lies elsewhere
};

}  // namespace dpde::model
