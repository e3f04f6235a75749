// SPDX-License-Identifier: Apache-2.0
// From an expression with derivatives to one with offsets. Rules, h the spacing along the axis of a derivative:
//  - a derivative of something that has none along this axis: central difference of the scheme's order of the whole;
//  - a first derivative of something that holds a first derivative along this axis, as d(kappa*dx(u), x): staggered.
//    The inside is taken at the half points, first derivatives by staggered differences, everything else interpolated
//    with the same order, coordinates exactly; then their difference. This is the conservative, compact flux form;
//  - every other nesting composes by shifting;
//  - on staggered grids, by the rules of model/analyse/placement.h: what holds fields of one placement and is wanted
//  there
//    goes by the rules above, with that placement in the part of the cell centres. Elsewhere a first derivative is
//    the staggered difference where its operand can be taken at the other placement along its axis, else the
//    central one;
//  - interpolate: the average of the order of `dx` from the operand's own placement, one axis after the other;
//  - advect: central is v*d(f), upwind(1) is max(v, 0)*(f - f[-1])/h + min(v, 0)*(f[+1] - f)/h, an axis each;
//    upwind(3), (5) and (7) likewise with differences of these orders, weno and muscl with the one of
//    upwind_difference.h on the side that the flow comes from; all as rises from cell to cell: of a constant they are 0
//    exactly.
//  - spectral: the sum of derivatives with uniform coefficients becomes a field of its own too, made by one transform;
//  - an operator whose adjoint is given becomes a field of its own too, stored by a kernel that holds that adjoint,
//    all its components by one; at another place it is another field, the operator of its arguments displaced;
//  - the outputs of a network become fields, of its arguments where placements say; at neighbours they are read like
//    any field;
//  - a reduction becomes a field of its own, stored before the kernel. Read at another place along axes that it
//    does not go over, it is the reduction of its operand at that place: walls and half points are then what they
//    are for the operand.
// Derivatives of plain fields at the current cell become lets (u_x, u_xx), so that each is computed once.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "model/analyse/placement.h"
#include "model/model.h"
#include "stencil/lower/iterations.h"
#include "stencil/space/finite_difference.h"
#include "stencil/space/waves.h"
#include "stencil/stencil.h"
#include "support/names/name_supply.h"

namespace dpde::stencil {

/// Nested differences multiply; past this many parts an expression is given up.
constexpr int max_parts = 50000;

/// The letter of an axis: its coordinate field is x, its spacing hx.
std::string axis_letter(int axis);
Expr spacing(int axis);
/// factor * product, as a person writes it: dt*nu*u_xx, not dt*(nu*u_xx).
Expr scaled(const Expr& factor, const Expr& product);

using FieldsOfStates = std::map<std::string, std::string>;

/// Which field stands for a state, and the time that is meant by t.
struct Environment {
  FieldsOfStates fields;               // those not named here stand for themselves
  std::map<std::string, Expr> values;  // of the parameters of an operator that are the same at all points
  Expr time;
  Environment();
};

/// A field that solves an equation: `kernel` makes `image` of `unknown`, `right` is what it shall be. `state` is no
/// state of the problem, but has the boundary of the unknown. The other fields are of use where that has values:
/// `at_rest` is 0 inside, `of_walls` its image, `total` what is left for the right side. `between_walls` is the unknown
/// of what lies on walls, with what it has there.
struct PreparedSolve {
  model::State state;
  std::string unknown, image, right, at_rest, of_walls, total, between_walls;
  Kernel kernel;
  SolveBy by = {};
  std::vector<std::string> guesses = {}, starts = {};  // states, and fields that are made beforehand
  std::optional<IterationFields> iterations = {};      // in the place of a solution
  std::optional<NetworkCall> preconditioner = {};  // of the residual, its first input, and of fields made beforehand

  /// The field that has what is found.
  const std::string& result() const { return iterations ? iterations->x.result : unknown; }
  /// All that have a name of its own.
  std::vector<std::string> fields_made() const;
};

/// What is to be done before a kernel that reads the results of reductions and of operators whose adjoint is given: a
/// kernel without a name, which stores what these are taken of, a reduction, or a kernel with the name of the operator.
using Prerequisite = std::variant<Kernel, Reduce, NetworkCall, Transform, PreparedSolve>;

/// Turns the expressions of one kernel into stencil expressions and collects the lets they share.
class Discretiser {
 public:
  /// No transport of `scheme` follows the flow. Lets take names that `names` does not know.
  Discretiser(const model::Scheme& scheme, NameSupply names, int rank, Environment reading = {},
              model::Placements placements = {});

  /// `e` at the current cell's point of a placement.
  Expr operator()(const model::Expr& e, const model::Placement& placement = {});
  /// A component of the velocity that carries what lies at `placement`, interpolated to there.
  Expr velocity(const model::Expr& e, const model::Placement& placement);
  const model::Placements& placements() const { return placements_; }
  const Environment& reading() const { return reading_; }
  /// Adds a let and returns its use; a literal, param, local or read is returned as it is.
  Expr shared(const std::string& wish, const Expr& value);
  /// From now on states and t mean what `reading` says; lets and preparations go on.
  void read(Environment reading) {
    reading_ = std::move(reading);
    derivative_lets_.clear();
    operands_.clear();
    known_.clear();
  }
  const std::vector<Let>& lets() const { return lets_; }
  const std::vector<Prerequisite>& preparations() const { return preparations_; }
  /// Whether what was asked for had more than max_parts; it was not worked out then.
  bool gave_up() const { return parts_ > max_parts; }

 private:
  /// Half cells from the centre of the current cell: odd along an axis means midway between two cells.
  using Place = std::array<int, max_rank>;
  /// What is true within its life of the expression that is worked on.
  class Within;
  /// top / (number * hx^powers[0] * ...): divisions of nested differences are done once, at the outside.
  struct Quotient {
    Expr top;
    double number = 1;  // whole
    std::array<int, max_rank> powers{};
    Expr value() const;
    bool same_bottom(const Quotient& other) const { return number == other.number && powers == other.powers; }
  };

  Quotient at(const model::Expr& e, const Place& place);
  Quotient at_base(const model::Expr& e, const Place& place);
  Quotient inside_difference(const model::Expr& e, const Place& place);
  Quotient at_halfway(const model::Expr& e, const Place& place, int axis);
  Quotient at_place(const model::Expr& e, const Place& place);
  Quotient reduced_at(const model::Expr& e, Place place);
  std::string stored_operand(const model::Expr& e, const Place& place);
  std::string store_before(const Discretiser& inner, const Expr& value, const Origin& origin);
  std::string stored_reduction(Reduce reduce);
  Expr inferred_at(const model::NetworkCall& e, const Place& place);
  std::string stored_solve(const model::Expr& e);
  IterationFields iteration_fields(const model::Solve& solve);
  NetworkCall preconditioner_of(const model::Solve& solve);
  Expr applied_at(const model::Expr& e, const Place& place);
  Environment reading_of(const model::Apply& e, const Place& place);
  std::vector<CustomAdjoint> custom_adjoints_of(const model::Apply& e, const Environment& reading,
                                                const model::Placements& inside, const Kernel& kernel,
                                                const Offset& offset);
  Quotient interpolated_at(const model::Expr& e, const Place& place);
  Quotient velocity_at(const model::Expr& e, const Place& place);
  Expr sample(const model::Sample& e, const Place& place);
  Quotient binary_at(const model::Binary& e, const Place& place);
  Quotient coordinate_at(const model::Coordinate& e, const Place& place);
  Quotient derivative_at(const model::Derivative& e, const Place& place, int accuracy);
  WaveReading wave_reading();
  Quotient waves_at(const model::Expr& e, const Place& place);
  std::optional<Quotient> sum_of_waves(const model::Binary& e, const Place& place);
  std::string stored_waves(const std::vector<WavePart>& parts);
  Expr band_at(const model::BandPass& band, const Place& place);
  std::string stored_transform(Transform transform);
  Quotient advect_at(const model::Advect& e, const Place& place);
  Quotient upwind_at(const model::Advect& e, const Place& place);
  Expr chosen_difference(const model::Transport& transport, const Expr& speed, const std::function<Expr(int)>& cell);
  Quotient combine(const Difference& difference, int axis, const model::Expr& e, const Place& place);
  Quotient placed_derivative(const model::Derivative& e, const Place& place, int accuracy);
  Expr named_derivative(const model::Derivative& e, const std::string& field, const Place& place, int accuracy);
  bool belongs_midway(const model::Expr& e, int axis) const;
  /// Midway between the points of the one placement that there is.
  bool is_midway(const Place& place, int axis) const;

  model::Scheme scheme_;
  NameSupply names_;
  int rank_;
  Environment reading_;
  model::Placements placements_;
  /// The placement of all fields of the expression, wanted there; nullopt: several, or somewhere else.
  std::optional<model::Placement> base_ = model::Placement{};
  std::vector<Let> lets_;
  std::vector<Prerequisite> preparations_;
  struct Operand {
    model::Expr value;
    Place place;
    std::string field;
  };
  std::vector<Operand> operands_;  // what is reduced, and where it is stored
  int parts_ = 0;
  /// Inside differences: the places of one overlap those of the next, and nested ones come to each many times.
  struct Known {
    model::Expr of;  // lives as long as the address that it is known by
    Quotient value;
    int parts;
  };
  using Where = std::tuple<const model::Node*, Place, std::optional<model::Placement>>;
  std::map<Where, Known> known_;
  int nesting_ = 0;                                     // > 0 inside a difference, where nothing is named
  std::map<std::string, std::string> derivative_lets_;  // field, axis, order and accuracy -> let
};

}  // namespace dpde::stencil
