// SPDX-License-Identifier: Apache-2.0
// Expressions of the model level: differential operators, reductions, calls of networks and equations that are solved,
// with all names resolved.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "model/scheme.h"
#include "source/source_file.h"
#include "support/side_conditions.h"
#include "support/vocabulary.h"

namespace dpde::model {

/// Along which axes values lie on the upper faces of the cells rather than at the centres.
using Placement = std::array<bool, 3>;

struct Node;
class Expr {
 public:
  Expr(double value);  // NOLINT: a number is an expression
  explicit Expr(Node node);
  const Node& node() const { return *node_; }
  const Node* operator->() const { return node_.get(); }
  bool operator==(const Expr& other) const;

 private:
  std::shared_ptr<const Node> node_;
};

struct Number {
  double value;
  bool operator==(const Number&) const = default;
};
struct Param {  // a parameter, or t (time), dt
  std::string name;
  bool operator==(const Param&) const = default;
};
struct Field {  // a state, coefficient or datum at the current point
  std::string name;
  bool operator==(const Field&) const = default;
};
struct Coordinate {  // x, y, z of the place where the expression is taken
  int axis;
  bool operator==(const Coordinate&) const = default;
};
/// White noise: a standard normal number in each cell, wherever in it the expression is taken. Filled in by the
/// runtime.
struct Noise {
  std::uint64_t seed;
  bool operator==(const Noise&) const = default;
};
struct Neg {
  Expr operand;
  bool operator==(const Neg&) const = default;
};
struct Binary {
  BinaryOp op;
  Expr left, right;
  bool operator==(const Binary&) const = default;
};
struct Call {
  Fn fn;
  std::vector<Expr> arguments;
  bool operator==(const Call&) const = default;
};
struct Select {
  Expr condition, yes, no;
  bool operator==(const Select&) const = default;
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
  std::vector<int> offset;  // one an axis
  bool operator==(const Shift&) const = default;
};
/// The operand, averaged from its own placement to the one that is wanted
struct Interpolate {
  Expr operand;
  bool operator==(const Interpolate&) const = default;
};
/// What the waves of the operand in shells `first` to `last` make, the modes exp(i k.x) with first - 1/2 <= |k|/unit <
/// last + 1/2, where the operand lies. `unit`: one wave along the longest axis.
struct BandPass {
  Expr operand;
  int first, last;
  double unit;
  bool operator==(const BandPass&) const = default;
};
/// The value of a field at a place between its points; the same at all points. One coordinate an axis, uniform. Along
/// each axis it is linear, or the point below or above.
struct Sample {
  std::string field;
  std::vector<Expr> place;
  std::array<InterpolationBasis, 3> along{};
  bool operator==(const Sample&) const = default;
};
/// mean, sum, ... over space: the same at all points along the axes it goes over
struct Reduce {
  enum class Kind { mean, sum, integral, max, min } reduction;
  Expr operand;
  std::array<bool, 3> over{true, true, true};  // all true where it is over all axes of the scene, however many
  bool is_over_all() const { return over == std::array{true, true, true}; }
  bool operator==(const Reduce&) const = default;
};

/// An operator of the file whose adjoint is given.
struct Operator {
  std::string name;
  std::vector<std::string> parameters;  // of a vector each component, u.x
  std::vector<Expr> body;               // the components of what it gives; parameters stand in it as fields
  struct Adjoint {
    std::string parameter;
    bool of_field = true;  // else what each point adds for an argument that is one parameter of the scene
    Expr value;            // of parameters and of the seeds, as fields
    Origin origin;
    bool operator==(const Adjoint&) const = default;
  };
  std::vector<Adjoint> adjoints;
  bool operator==(const Operator&) const = default;
};
/// A component of what an operator makes of its arguments: a field of its own, stored by a kernel whose adjoint is the
/// given one.
struct Apply {
  Operator function;
  std::vector<Expr> arguments;
  int component = 0;
  std::vector<std::optional<Placement>> places = {};  // of the arguments; none: known everywhere
  std::vector<Placement> results = {};                // where the components are unless they are wanted elsewhere
  bool operator==(const Apply&) const = default;
};
/// The field that stands for the seed of a component in the formulas of an operator.
std::string seed_of(const Operator& function, std::size_t component);

/// One output of a network, a field of its own at the cell centres, made of the arguments there.
struct NetworkCall {
  std::string network;
  std::vector<Expr> arguments;  // one a channel
  int output = 0, outputs = 1;
  std::string name;  // of the output, as corrector(u).x has x; "" where it is the only one
  bool operator==(const NetworkCall&) const = default;
};

/// One side of a bounded axis.
struct Side {
  SideKind kind = SideKind::value;
  Expr value = 0.0;       // of numbers, parameters, t and coordinates; 0 where the condition is given none
  Expr a = 0.0, b = 0.0;  // where it is given them: the same along the wall
  bool operator==(const Side&) const = default;
};
struct AxisSides {
  Side low, high;  // not looked at on periodic axes
  bool operator==(const AxisSides&) const = default;
};
/// The field, at cell centres, for which `operation` is `right`. It is called `name` in `operation`, which is linear in
/// it.
struct Solve {
  std::string name;
  Expr operation, right;
  std::vector<AxisSides> boundary;  // one an axis
  /// States the best sum of whose multiples is near it, and that lie where it lies.
  std::vector<std::string> guesses = {};
  /// As the model says, fields beside them, which have no part in derivatives; where `iterations` is known they have.
  std::vector<Expr> starts = {};
  /// What a network makes of the residual of an iteration, which is called `name` in it too: a call of one output. It
  /// has no part in derivatives; where `iterations` is known it has.
  std::optional<Expr> preconditioner = {};
  /// What so many conjugate gradients make of the start, each of them differentiated, is the value; nullopt: the
  /// solution.
  std::optional<int> iterations = {};
  bool operator==(const Solve&) const = default;
};

using Kind = std::variant<Number, Param, Field, Coordinate, Noise, Neg, Binary, Call, Select, Derivative, Advect, Shift,
                          Interpolate, BandPass, Sample, Reduce, Apply, NetworkCall, Solve>;
struct Node {
  Kind kind;
  Origin origin;
  bool operator==(const Node&) const = default;
};

}  // namespace dpde::model
