// SPDX-License-Identifier: Apache-2.0
// Explicit Runge-Kutta methods as kernels, one a stage, every kernel covering all states. Between stages only states
// are kept, never slopes ("stage-state form"): with U1 = u + dt/2 F(u), U2 = u + dt/2 F(U1), U3 = u + dt F(U2)
// the classical RK4 step is (U1 + 2 U2 + U3 - u)/3 + dt/6 F(U3), as dt F(u) = 2 (U1 - u) and so on. SSP-RK3 is written
// that way by its authors (Shu and Osher 1988): convex combinations of Euler steps. An equation of second order is two
// of first order, for u and its velocity u_t; velocity Verlet alone treats them differently.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "model/model.h"
#include "stencil/lower/lowering.h"

namespace dpde::stencil {

/// A state to be advanced by dt(state) = rate, and the field that gets the result.
struct Advance {
  std::string state;
  model::Expr rate;
  std::string into;
  Origin origin;
};

/// One of `of` equal parts of the step, which begins with the states.
struct StepPart {
  int of = 1;
  std::string counter;  // a parameter, the number of the part
  /// The fields that stand for states which others advance, at these fractions of the part; those not named stay what
  /// they are.
  std::map<double, std::map<std::string, std::string>> others = {};
  bool is_projected = true;  // constraints are made true behind each stage

  /// When this fraction of the part is over, from where the step begins, in steps.
  Expr time(double fraction) const;
  /// The same in the scene's units, from its beginning.
  Expr time_at(double fraction) const;
};

/// One step of the scheme's time integrator, which has no memory (multistep.h has those), or a part of it (whole where
/// it solves for terms: implicit_schemes.h). A single
/// kernel is called `name`, several PREFIX_stage1, PREFIX_stage2, ... Rates have no semi-Lagrangian advect. A state
/// whose rate is 0 has no stages of its own.
std::vector<Stage> time_stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& name,
                               const std::string& prefix, const StepPart& part = {});

/// When its stages look at other states, from 0 to 1: those of its rows too.
std::vector<double> stage_times(model::TimeScheme time);

/// What a step makes of a state with dt(u) = (z/dt)*u: its stability function, a polynomial of z (E. Hairer and
/// G. Wanner, Solving Ordinary Differential Equations II, IV.2), by powers. Empty of schemes that are none of rows
/// alone.
std::vector<double> stability_polynomial(model::TimeScheme time);

/// The same of an embedded pair, with a kernel behind it whose only sum says how large the error is: over all cells
/// that of the square of the estimated error over the tolerated one, the mean over the states. The pair's other result
/// is a stage like the others.
std::vector<Stage> stages_with_estimate(Lowering& lowering, const std::vector<Advance>& advances,
                                        const std::string& name, const std::string& prefix);

}  // namespace dpde::stencil
