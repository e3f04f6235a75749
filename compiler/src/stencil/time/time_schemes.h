// SPDX-License-Identifier: Apache-2.0
// Explicit Runge-Kutta methods, one kernel per stage, for all states. Between stages only states are stored, never
// slopes ("stage-state form"): with U1 = u + dt/2 F(u), U2 = u + dt/2 F(U1), U3 = u + dt F(U2) the classical RK4 step
// is (U1 + 2 U2 + U3 - u)/3 + dt/6 F(U3), as dt F(u) = 2 (U1 - u) and so on. Shu and Osher (1988) write SSP-RK3 in this
// form: convex combinations of Euler steps. An equation of second order is two of first order, for u and its velocity
// u_t; only velocity Verlet treats the two differently.
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

/// One of `of` equal substeps, which starts from the states.
struct StepPart {
  int of = 1;
  std::string counter;  // a parameter, the number of the substep
  /// By fraction of the substep: the fields that replace states which other stages advance; states not named are not
  /// replaced.
  std::map<double, std::map<std::string, std::string>> others = {};
  bool is_projected = true;  // each stage ends with the projection onto the constraints

  /// Time after this fraction of the substep, since the start of the step, in steps.
  Expr time(double fraction) const;
  /// The same as time of the scene, in its units.
  Expr time_at(double fraction) const;
};

/// One step, or a substep, of the scheme's one-step time integrator (multistep.h has multistep schemes). For implicit
/// schemes it is a whole step (implicit_schemes.h). A single kernel is called `name`, several PREFIX_stage1,
/// PREFIX_stage2, ... Rates have no semi-Lagrangian advect. A state whose rate is 0 has no stages of its own.
std::vector<Stage> time_stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& name,
                               const std::string& prefix, const StepPart& part = {});

/// Times from 0 to 1 at which stages read other states, including those of the tableau's rows.
std::vector<double> stage_times(model::TimeScheme time);

/// Stability function of a step, for dt(u) = (z/dt)*u: the coefficients of a polynomial of z by powers (E. Hairer and
/// G. Wanner, Solving Ordinary Differential Equations II, IV.2). Empty for schemes that are not given by a tableau.
std::vector<double> stability_polynomial(model::TimeScheme time);

/// One step of an embedded pair, followed by a kernel with one sum, the error: over all cells it adds the square of the
/// estimated error over the tolerated error, averaged over the states. The pair's other result is one more stage.
std::vector<Stage> stages_with_estimate(Lowering& lowering, const std::vector<Advance>& advances,
                                        const std::string& name, const std::string& prefix);

}  // namespace dpde::stencil
