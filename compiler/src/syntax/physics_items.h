// SPDX-License-Identifier: Apache-2.0
// The lines of models and scenes, as written.
#pragma once

#include <optional>
#include <vector>

#include "syntax/expression.h"

namespace dpde::ast {

/// in m/s: unit of a declared name or a value; nullopt: not given. After several names it applies to the preceding
/// names that have neither a unit nor a value: field u, v in m/s, h in m
using UnitText = std::optional<Identifier>;

// ---- items inside a model ------------------------------------------------------------------------------------------
struct FieldItem {  // field u, v          vector u on faces       (a component for each axis of the scene)
  std::vector<Identifier> names;
  bool vector = false;
  std::optional<Identifier> on;      // centres, faces, faces.x, nodes
  std::vector<UnitText> units = {};  // one for each name
};
// coefficient kappa, coefficient vector v      (a given field, constant in time)
// control field F, control vector G            (one field for each interval of time)
struct CoefficientItem {
  std::vector<Identifier> names;
  bool vector = false;
  std::optional<Identifier> on;
  bool control = false;
  bool mask = false;                 // mask solid: true where a condition of the scene holds
  std::vector<UnitText> units = {};  // one for each name
};
struct ParamItem {  // param nu = 0.01 in m^2/s, c
  std::vector<Identifier> names;
  std::vector<std::optional<Expr>> values;  // one for each name: default if the scene gives none
  std::vector<UnitText> units;              // one for each name
};
struct ControlItem {  // control F, G       (a parameter with one value for each interval of time)
  std::vector<Identifier> names;
  std::vector<UnitText> units;  // one for each name
};
struct LetItem {  // let s = u + v           (models, scenes and kernels)
  Identifier name;
  Expr value;
  UnitText unit = {};  // in models and scenes
};
struct EquationItem {  // dt(u) = rhs, or dt(dt(u)) = rhs with field "dt(u)"
  Identifier field;
  Expr rhs;
};

struct SolvedItem {  // solve lap(phi) = omega for phi      (holds at every time)
  Expr left, right;
  Identifier unknown;
  UnitText unit = {};
  std::vector<Expr> starts =
      {};  // ... for phi from guess(omega): iterative methods start with the best linear combination
  std::optional<int> iterations = {};  // ... after 5 iterations: their result, not the solution
  /// ... preconditioner smooth(residual): the network's output for the residual; before `after`
  std::optional<Expr> preconditioner = {};
};
struct ConstraintItem {  // 0 = div(u) gives p      (p in the other equations enforces the constraint)
  Expr zero, value;      // the left side, which must be 0, and the right side
  Identifier multiplier;
  std::vector<Expr> starts = {};  // as for solve
  std::optional<Expr> preconditioner = {};
  std::optional<Identifier> each = {};  // ... gives p each step, or each stage; before `from`
};
struct HeldItem {  // u = 0 inside solid
  Identifier field;
  Expr value;
  Identifier mask;
};

// ---- items inside a scene ------------------------------------------------------------------------------------------
struct GridItem {  // grid x = -1 .. 1, cells 128, periodic
  Identifier axis;
  Expr low, high;
  std::optional<Expr> cells;
  bool periodic = false;
  std::optional<Expr> stretched;  // positions of the points, for x uniform from low to high
  UnitText unit = {};
};
struct CellsItem {  // cells 64            cells 64, 32      (of all axes, or axis by axis)
  std::vector<Expr> counts;
  bool is_of_other = false;  // from the base scene of a derived scene
};
struct CoordinatesItem {  // coordinates polar     coordinates sphere(a)     coordinates metric(1, x)
  Expr kind;              // the Name of a kind, or a Call of one
};
struct ValueItem {  // nu = 0.01/pi          (parameter or coefficient; also the rows of a scheme block)
  Identifier name;
  Expr value;
  std::optional<Expr> every;          // for a control: F = sin(t) every 0.1
  std::optional<Identifier> of = {};  // for a scheme: advect marker = maccormack
  UnitText unit = {};                 // for a scene: nu = 1e-3 in m^2/s
};
// initial u = load("run.nc", u) at t = 0.5     initial u = (y, 0) projected     initial dt(u) = 0, with field "dt(u)"
struct InitialItem {
  Identifier field;
  Expr value;
  std::optional<Expr> at;
  std::optional<SourceRange> projected = {};
};
struct ExactItem {  // exact u = exp(-t)*sin(x)
  Identifier field;
  Expr value;
};
struct BoundarySide {  // x.low = 0     x = zero_gradient     all = 0
  Identifier place;
  Expr value;  // an expression, or the Name of a condition, such as zero_gradient or periodic
};
struct BoundaryItem {  // boundary u: x.low = 0, x.high = 1
  Identifier field;
  std::vector<BoundarySide> sides;
  bool bare = false;  // boundary u = 0
};
struct TimeItem {  // time 0 .. 1, step 1/32, courant 0.4, speed |u| + c     time 0 .. 9, step 0.1, until steady 1e-8
                   // time 0 .. 1, step 1/32, tolerance 1e-6, absolute 1e-9, first 1e-3
  Expr from, to;
  std::optional<Expr> step, courant, speed, tolerance, absolute, first, steady;
  UnitText unit = {};  // time 0 .. 1 in s
};
struct StepItem {  // step 1/32             (with a hand-written loop, or in a derived scene)
  Expr step;
};
struct OutputItem {  // output u, v every 0.1
  std::vector<Identifier> fields;
  std::optional<Expr> every;
};
/// after step: u = max(u, 0)     every 0.1: a += 1, b = 0     at t = 0.5, 1: u = 0      (all use the old values)
struct EventItem {
  struct Update {
    Identifier field;
    bool accumulate = false;
    Expr value;
  };
  std::optional<Expr> every;  // neither this nor times: after each step
  std::vector<Expr> times;
  std::vector<Update> updates;
};
struct SubcycleItem {  // subcycle b, c in 4
  std::vector<Identifier> fields;
  Expr parts;
};
struct AccuracyItem {  // accuracy 1e-3 on u, v      (relative, at the end of the run; without fields: all)
  Expr tolerance;
  std::vector<Identifier> fields;
};
struct ObserveItem {  // observe energy = 0.5*integral(u^2)
  Identifier name;
  Expr value;
  UnitText unit = {};
};

}  // namespace dpde::ast
