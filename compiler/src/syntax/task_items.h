// SPDX-License-Identifier: Apache-2.0
// Lines of tasks, data sets and charts, as written.
#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "syntax/expression.h"

namespace dpde::ast {

// ---- items inside a task -------------------------------------------------------------------------------------------
struct WhenAt {  // at t = 0.5, 1.0
  std::vector<Expr> times;
};
struct WhenOver {                     // over time: every state from the first to the last
  std::optional<Identifier> counted;  // , mean over time   , sum over time   , integral over time
};
struct WhenSteps {  // over 4 steps: each state of the given number of steps after the start of a run
  Expr steps;
  std::optional<Identifier> counted;
  bool is_last = false;  // after 4 steps: only the last of them
};
struct WhenEnd {};  // no time given: the last state
using When = std::variant<WhenEnd, WhenAt, WhenOver, WhenSteps>;

// data v on faces.x = load("v.npy")  |  data w = trajectories("w.nc", u)  |  data r = u from scene fine at t = 0.5
struct DataItem {
  Identifier name;
  std::optional<Identifier> on;
  Expr value;                       // load("...") or the name of a field
  std::optional<Identifier> scene;  // after `from scene`
  When when;
  std::optional<Identifier> unit = {};  // in K
};
struct UnknownItem {  // unknown initial u from 0      unknown nu from 0.01 in 0 .. 1
  bool initial = false;
  Identifier name;
  std::optional<Expr> from, low, high;
};
struct MinimiseItem {  // minimise mean((u - u_ref)^2) at t = 0.5
  Expr loss;
  When when;
};
struct LearnItem {  // learn corrector from "start.safetensors"
  Identifier network;
  std::optional<Expr> from;  // a Text
};
struct UsingItem {  // using adam(rate = 1e-3), batch 4, unroll (1, 2, 4), iterations 50
  Expr optimiser;
  std::vector<Argument> options;  // batch 4 has the name batch and the value 4
};
/// omega = curl(u), w on centres = curl(u); or only a name
struct NamedFormula {
  Identifier name;
  std::optional<Identifier> on;
  std::optional<Expr> value;
};
/// test mae = mean(abs(u - u_true)) over time        growth rate on trajectories("test.nc") for 250 steps
/// test e = mean(u^2) on trajectories("test.nc") for 250 steps beside plain, fine on trajectories("fine.nc")
/// the same, beside vortex where omega = curl(u)
/// also with statistic, spectrum energy = u, correlation vorticity = curl(u) above 0.8
struct TestItem {  // a number reported after optimising
  enum class Kind { test, statistic, spectrum, correlation, growth } kind = Kind::test;
  struct Baseline {  // another scene, optionally with its own file
    Identifier scene;
    std::optional<Expr> on;
    std::vector<NamedFormula> map;  // its states computed from the data: where omega = curl(u)
  };
  Identifier name;
  Expr value;  // not for growth
  When when;
  std::optional<Expr> above;  // for correlation
  std::optional<Expr> on, steps;
  std::vector<Baseline> beside;
};

// ---- items inside a data set ---------------------------------------------------------------------------------------
struct VaryItem {  // vary nu in 0.01 .. 0.1 [logarithmic]     vary re in 100, 200     vary s from 100
  Identifier name;
  std::optional<Expr> low, high;  // random number in this range, uniform or of uniform logarithm
  bool is_log = false;
  std::vector<Expr> values;  // used one after the other
  std::optional<Expr> from;  // 100, 101, ...
};
struct FramesItem {  // frames every 0.1 from 3 to 23     frames of u, omega = curl(u) every 0.1
  Expr every;
  std::optional<Expr> from, to;
  std::vector<NamedFormula> of;  // replaces the list of all states
};
struct OptionItem {  // runs 10     seed 3     coarsen 4     file "train.nc"     coarsen 2 in "finer.nc"
  Identifier name;
  Expr value;
  std::optional<Expr> in = {};
};

// ---- items inside a chart ------------------------------------------------------------------------------------------
struct ReferenceItem {  // reference exact      reference manufactured      reference self(cells = 4096)
  Expr value;
};
struct ChoicesItem {  // vary advect in central(2), upwind(3)
  Identifier key;
  std::vector<Expr> values;
};
struct ErrorItem {  // error l2(u), linf(v) at t = 1
  std::vector<Expr> norms;
  std::optional<Expr> at;
};

}  // namespace dpde::ast
