// SPDX-License-Identifier: Apache-2.0
// Expressions of the model level: differential operators, reductions, calls of networks and equations that are solved,
// with all names resolved.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "model/scheme.h"
#include "source/source_file.h"
#include "support/expression.h"
#include "support/side_conditions.h"
#include "support/vocabulary.h"

namespace dpde::model {

/// Axes along which the values lie on the upper faces of the cells instead of the centres.
using Placement = std::array<bool, 3>;

struct Node;
using Expr = ExprOf<Node>;
using Neg = NegOf<Expr>;
using Binary = BinaryOf<Expr>;
using Call = CallOf<Expr>;
using Select = SelectOf<Expr>;

using Number = Literal;
struct Param {  // a parameter, or t (time), dt
  std::string name;
  bool operator==(const Param&) const = default;
};
struct Field {  // a state, coefficient or datum at the current point
  std::string name;
  bool operator==(const Field&) const = default;
};
struct Coordinate {  // x, y, z of the point where the expression is evaluated
  int axis;
  bool operator==(const Coordinate&) const = default;
};
/// White noise: a standard normal number in each cell, the same wherever in the cell the expression is evaluated.
/// Filled in by the runtime.
struct Noise {
  std::uint64_t seed;
  bool operator==(const Noise&) const = default;
};
/// d^order operand / d axis^order
struct Derivative {
  Expr operand;
  int axis;
  int order;
  bool operator==(const Derivative&) const = default;
};
/// velocity . grad(operand), discretised by the scheme's `advect`; one velocity component an axis
struct Advect {
  std::vector<Expr> velocity;
  Expr operand;
  bool operator==(const Advect&) const = default;
};
/// The operand at the point displaced by whole cells
struct Shift {
  Expr operand;
  std::vector<int> offset;  // one per axis
  bool operator==(const Shift&) const = default;
};
/// The operand, averaged from its own placement to the required one
struct Interpolate {
  Expr operand;
  bool operator==(const Interpolate&) const = default;
};
/// Band-pass filter: the waves of the operand in shells `first` to `last`, which are the modes exp(i k.x) with first -
/// 1/2 <= |k|/unit < last + 1/2. Same placement as the operand. `unit`: wavenumber of one wave along the longest axis.
struct BandPass {
  Expr operand;
  int first, last;
  double unit;
  bool operator==(const BandPass&) const = default;
};
/// The value of a field at a position between its points; uniform in space. One uniform coordinate per axis. Along each
/// axis interpolation is linear, or takes the point below or above.
struct Sample {
  std::string field;
  std::vector<Expr> place;
  std::array<InterpolationBasis, 3> along{};
  bool operator==(const Sample&) const = default;
};
/// mean, sum, ... over space; the result is uniform along the axes of the reduction
struct Reduce {
  enum class Kind { mean, sum, integral, max, min } reduction;
  Expr operand;
  std::array<bool, 3> over{true, true, true};  // all true: over all axes of the scene, however many
  bool is_over_all() const { return over == std::array{true, true, true}; }
  bool operator==(const Reduce&) const = default;
};

/// An operator of the file with a given adjoint.
struct Operator {
  std::string name;
  std::vector<std::string> parameters;  // of a vector each component, u.x
  std::vector<Expr> body;               // components of the result; parameters stand in it as fields
  struct Adjoint {
    std::string parameter;
    bool of_field = true;  // false: each point's contribution to an argument that is one parameter of the scene
    Expr value;            // of parameters and of the seeds of the adjoint, as fields
    Origin origin;
    bool operator==(const Adjoint&) const = default;
  };
  std::vector<Adjoint> adjoints;
  bool operator==(const Operator&) const = default;
};
/// A component of an operator applied to its arguments: a separate field, stored by a kernel with the given adjoint.
struct Apply {
  Operator function;
  std::vector<Expr> arguments;
  int component = 0;
  std::vector<std::optional<Placement>> places = {};  // placements of the arguments; nullopt: known everywhere
  std::vector<Placement> results = {};                // placements of the components, unless others are required
  bool operator==(const Apply&) const = default;
};
/// The field that stands for the adjoint seed of a component in the formulas of an operator.
std::string seed_of(const Operator& function, std::size_t component);

/// One output of a network: a separate field, at the cell centres, computed from the arguments there.
struct NetworkCall {
  std::string network;
  std::vector<Expr> arguments;  // one per channel
  int output = 0, outputs = 1;
  std::string name;  // of the output, as x in corrector(u).x; "" for a single output
  bool operator==(const NetworkCall&) const = default;
};

/// One side of a bounded axis.
struct Side {
  SideKind kind = SideKind::value;
  Expr value = 0.0;       // of numbers, parameters, t and coordinates; 0 if the condition takes none
  Expr a = 0.0, b = 0.0;  // if the condition takes them: constant along the wall
  bool operator==(const Side&) const = default;
};
struct AxisSides {
  Side low, high;  // ignored on periodic axes
  bool operator==(const AxisSides&) const = default;
};
/// The solution, a field at cell centres, of `operation` = `right`. `operation` is linear in the unknown, which is
/// called `name` in it.
struct Solve {
  std::string name;
  Expr operation, right;
  std::vector<AxisSides> boundary;  // one per axis
  /// States of the same placement; their best linear combination approximates the solution.
  std::vector<std::string> guesses = {};
  /// Start values from the model, additional fields. They are differentiated only if `iterations` is given.
  std::vector<Expr> starts = {};
  /// A network applied to the residual of an iteration, which is also called `name` here: a call with one output. It is
  /// differentiated only if `iterations` is given.
  std::optional<Expr> preconditioner = {};
  /// Number of conjugate-gradient iterations: the value is the result of that many from the start, each differentiated;
  /// nullopt: the exact solution.
  std::optional<int> iterations = {};
  bool operator==(const Solve&) const = default;
};

using Kind = std::variant<Number, Param, Field, Coordinate, Noise, Neg, Binary, Call, Select, Derivative, Advect, Shift,
                          Interpolate, BandPass, Sample, Reduce, Apply, NetworkCall, Solve>;
struct Node {
  Kind kind;
  Origin origin = {};
  bool operator==(const Node&) const = default;
};
void for_each_child(const Node& node, FunctionRef<void(const Expr&)> f);
void for_each_child(Node& node, FunctionRef<void(Expr&)> f);
inline Expr rebuilt(Node node) { return Expr(std::move(node)); }

}  // namespace dpde::model

extern template class dpde::ExprOf<dpde::model::Node>;
