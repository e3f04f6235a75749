// SPDX-License-Identifier: Apache-2.0
// Translates an expression with derivatives into one with offsets. Rules, h the spacing along a derivative's axis:
//  - a derivative whose operand has none along this axis: central difference of the scheme's order of the operand;
//  - a first derivative whose operand has a first derivative along this axis, as d(kappa*dx(u), x): staggered.
//    The operand is evaluated at the half points: first derivatives by staggered differences, coordinates exactly,
//    everything else interpolated with the same order. Then its difference is taken. This is the conservative, compact
//    flux form;
//  - every other nesting composes by shifting;
//  - staggered grids follow the rules of model/analyse/placement.h. An expression of fields of one placement, evaluated
//    there, follows the rules above with that placement instead of the cell centres. Otherwise a first derivative is
//    the staggered difference if its operand can be evaluated at the other placement along its axis, else the
//    central one;
//  - interpolate: the average of the order of `dx` from the operand's own placement, one axis after the other;
//  - advect: central is v*d(f), upwind(1) is max(v, 0)*(f - f[-1])/h + min(v, 0)*(f[+1] - f)/h, for each axis;
//    upwind(3), (5) and (7) likewise with differences of these orders; weno and muscl use the upwind one of
//    upwind_difference.h. All are written with differences between cells, so they are exactly 0 for a constant;
//  - spectral: the sum of derivatives with uniform coefficients becomes a field, computed by one transform;
//  - an operator with a custom adjoint becomes a field, stored by a kernel that holds that adjoint; one kernel stores
//    all components. At another point it is another field: the operator of its displaced arguments;
//  - the outputs of a network become fields, with arguments at the placements of model::Placements; at neighbours they
//    are read like any field;
//  - a reduction becomes a field, stored before the kernel. At another point along axes that it does not reduce it is
//    the reduction of its operand at that point, so that the operand's rules hold for walls and half points.
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

/// The number of terms is a product over nested differences; beyond this many the translation stops.
constexpr int max_parts = 50000;

/// The letter of an axis: its coordinate field is x, its spacing hx.
std::string axis_letter(int axis);
Expr spacing(int axis);
/// factor * product, in the usual notation: dt*nu*u_xx, not dt*(nu*u_xx).
Expr scaled(const Expr& factor, const Expr& product);

using FieldsOfStates = std::map<std::string, std::string>;

/// The field that replaces each state, and the value of t.
struct Environment {
  FieldsOfStates fields;               // other states are not replaced
  std::map<std::string, Expr> values;  // of an operator's parameters that are uniform in space
  Expr time;
  Environment();
};

/// A field that solves an equation: `kernel` computes `image`, the operator applied to `unknown`; `right` is the right
/// side. `state` is not a state of the problem; it holds the boundary of the unknown. If that boundary has values, the
/// other fields are used: `at_rest` is 0 inside, `of_walls` its image, `total` the remaining right side. For an unknown
/// that lies on walls, `between_walls` is the unknown with its values on the walls.
struct PreparedSolve {
  model::State state;
  std::string unknown, image, right, at_rest, of_walls, total, between_walls;
  Kernel kernel;
  SolveBy by = {};
  std::vector<std::string> guesses = {}, starts = {};  // states, and fields that are computed before
  std::optional<IterationFields> iterations = {};      // replace the solve
  std::optional<NetworkCall> preconditioner = {};  // inputs: first the residual, then fields that are computed before

  /// The field with the solution.
  const std::string& result() const { return iterations ? iterations->x.result : unknown; }
  /// All fields that were created for the solve.
  std::vector<std::string> fields_made() const;
};

/// A statement that runs before a kernel which reads results of reductions, operators with a custom adjoint and the
/// like: a kernel without a name that stores operands, a kernel with the name of the operator, a reduction, ...
using Prerequisite = std::variant<Kernel, Reduce, NetworkCall, Transform, PreparedSolve>;

/// Turns the expressions of one kernel into stencil expressions and collects the lets they share.
class Discretiser {
 public:
  /// No transport of `scheme` is semi-Lagrangian. Names of lets are taken from `names`.
  Discretiser(const model::Scheme& scheme, NameSupply names, int rank, Environment reading = {},
              model::Placements placements = {});

  /// `e` at the current cell, at the point of `placement`.
  Expr operator()(const model::Expr& e, const model::Placement& placement = {});
  /// A component of the velocity that transports a field at `placement`, interpolated to that placement.
  Expr velocity(const model::Expr& e, const model::Placement& placement);
  const model::Placements& placements() const { return placements_; }
  const Environment& reading() const { return reading_; }
  /// Adds a let and returns its use; a literal, param, local or read is returned as it is.
  Expr shared(const std::string& wish, const Expr& value);
  /// Replaces the environment of states and t; lets and preparations are kept.
  void read(Environment reading) {
    reading_ = std::move(reading);
    derivative_lets_.clear();
    operands_.clear();
    known_.clear();
  }
  const std::vector<Let>& lets() const { return lets_; }
  const std::vector<Prerequisite>& preparations() const { return preparations_; }
  /// Whether an expression had more than max_parts; its translation was then stopped.
  bool gave_up() const { return parts_ > max_parts; }

 private:
  /// Half cells from the centre of the current cell: odd along an axis means midway between two cells.
  using Place = std::array<int, max_rank>;
  /// Sets the base placement during its lifetime.
  class Within;
  /// top / (number * hx^powers[0] * ...): divisions of nested differences are done once, at the outside.
  struct Quotient {
    Expr top;
    double number = 1;  // a whole number
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
  /// Whether `place` is midway between the points of the base placement.
  bool is_midway(const Place& place, int axis) const;

  model::Scheme scheme_;
  NameSupply names_;
  int rank_;
  Environment reading_;
  model::Placements placements_;
  /// The placement of all fields of the expression, if it is evaluated there; nullopt: several placements, or another.
  std::optional<model::Placement> base_ = model::Placement{};
  std::vector<Let> lets_;
  std::vector<Prerequisite> preparations_;
  struct Operand {
    model::Expr value;
    Place place;
    std::string field;
  };
  std::vector<Operand> operands_;  // expressions that are stored in fields
  int parts_ = 0;
  /// Results inside differences: the points of neighbouring differences overlap, so that nested differences evaluate
  /// each point many times.
  struct Known {
    model::Expr of;  // keeps the node of the key alive
    Quotient value;
    int parts;
  };
  using Where = std::tuple<const model::Node*, Place, std::optional<model::Placement>>;
  std::map<Where, Known> known_;
  int nesting_ = 0;                                     // > 0 inside a difference, where no lets are made
  std::map<std::string, std::string> derivative_lets_;  // field, axis, order and accuracy -> let
};

}  // namespace dpde::stencil
