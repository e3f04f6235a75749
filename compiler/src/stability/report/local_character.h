// SPDX-License-Identifier: Apache-2.0
// What a frozen step does beside being stable: how advection compares with diffusion in a cell, whether it keeps values
// between their neighbours', and how it damps and delays waves.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "driver/scene/session.h"
#include "stability/step/linear_step.h"

namespace dpde::stability {

/// |a|*h/D along an axis, a and D from the equations linearised at a point: with c_k the weight of the cell k of what
/// central differences of order 2 make of them, a = -h sum k c_k and D = h^2/2 sum k^2 c_k. A cell Reynolds number
/// where a depends on the field itself, else a cell Peclet number.
struct CellNumber {
  std::string field;
  int axis = 0;
  double speed = 0, diffusion = 0, number = 0;  // infinite without diffusion
  bool is_reynolds = false;
  /// Above 2, and nothing is done against it: with central differences of advection a steady layer alternates from cell
  /// to cell (P. J. Roache, Computational Fluid Dynamics, 1972, III-A-8).
  bool rings = false;
  std::string place;
};
/// Of each field and axis along which it is carried the largest over the frozen points of the scene. Empty for
/// hand-written programs.
std::vector<CellNumber> cell_numbers(driver::Session& session);

/// Transport whose differences are taken on the side that the flow goes to: what they add to the equations is diffusion
/// below 0, of the size of |a|*h, and waves of two cells grow at every step.
struct Downwind {
  std::string field;
  SourceRange range;  // of the advect(...) of its equation
  std::string place;
};
/// One a field; empty where all look to the wind, and for hand-written programs.
std::vector<Downwind> downwind_differences(driver::Session& session);
/// What to write in its place.
std::string downwind_text(const Downwind& found);

/// Whether no weight of a step is negative: then no field falls below 0 that begins above it, and none leaves the range
/// of its start but by sources (A. Harten, J. Comput. Phys. 49 (1983)).
struct Positivity {
  std::string why;  // it is not known, and why
  bool is_kept = false;
  double largest_step = 0;  // that keeps it; infinite: each; 0: none
};
/// Of a step (or the first part of one) from the initial state.
Positivity positivity_of(driver::Session& session, double step, const StateGroup& group = {});

/// What a step makes of a wave beside what the equations do, at a frozen point.
struct Wave {
  int axis = 0;
  double cells = 0;                                         // a wavelength
  double growth = 1, exact_growth = 1;                      // a step
  double phase = std::numeric_limits<double>::quiet_NaN();  // speed over the exact one; NaN where it stands
};
/// Of 4, 8, 16 and 32 cells along each axis, a row for each mode of the equations. Those are the eigenvalues of the
/// equations by differences of order 8 on cells of a sixteenth; the step's are those next to exp(step*eigenvalue).
std::vector<Wave> waves_of(const driver::Session& session, const FrozenPoint& point, double step,
                           const StateGroup& group = {});

}  // namespace dpde::stability
