// SPDX-License-Identifier: Apache-2.0
// Properties of a frozen step other than stability: cell Peclet numbers, positivity, and the damping and phase error of
// waves.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "driver/scene/session.h"
#include "stability/step/linear_step.h"

namespace dpde::stability {

/// |a|*h/D along an axis, with a and D from the equations linearised at a point: if c_k is the weight of cell k with
/// central differences of order 2, then a = -h sum k c_k and D = h^2/2 sum k^2 c_k. It is a cell Reynolds number if a
/// depends on the field itself, else a cell Peclet number.
struct CellNumber {
  std::string field;
  int axis = 0;
  double speed = 0, diffusion = 0, number = 0;  // infinite without diffusion
  bool is_reynolds = false;
  /// The number is above 2 and the scheme adds no diffusion: with central differences of advection a steady layer then
  /// oscillates from cell to cell (P. J. Roache, Computational Fluid Dynamics, 1972, III-A-8).
  bool rings = false;
  std::string place;
};
/// The largest number over the frozen points of the scene, for each field and each axis of its advection. Empty for
/// hand-written programs.
std::vector<CellNumber> cell_numbers(driver::Session& session);

/// Advection with downwind differences: they add a negative diffusion of the order |a|*h, and waves of two cells grow
/// at every step.
struct Downwind {
  std::string field;
  SourceRange range;  // of the advect(...) of its equation
  std::string place;
};
/// At most one per field; empty if no differences are downwind, and for hand-written programs.
std::vector<Downwind> downwind_differences(driver::Session& session);
/// A suggestion how to replace it.
std::string downwind_text(const Downwind& found);

/// Whether no weight of a step is negative. Then a field that begins above 0 does not fall below it, and only sources
/// make a field leave its initial range (A. Harten, J. Comput. Phys. 49 (1983)).
struct Positivity {
  std::string why;  // the reason why it is not known; "": it is
  bool is_kept = false;
  double largest_step = 0;  // the largest positive step; infinite: every step; 0: none
};
/// For a step (or its first substep) from the initial state.
Positivity positivity_of(driver::Session& session, double step, const StateGroup& group = {});

/// A wave in a step compared with the equations, at a frozen point.
struct Wave {
  int axis = 0;
  double cells = 0;                                         // per wavelength
  double growth = 1, exact_growth = 1;                      // factors per step
  double phase = std::numeric_limits<double>::quiet_NaN();  // phase speed / exact phase speed; NaN if that is 0
};
/// For waves of 4, 8, 16 and 32 cells along each axis: one entry per mode of the equations. Exact modes are eigenvalues
/// of the equations with differences of order 8 on cells of a sixteenth. The step's modes are its eigenvalues nearest
/// to exp(step*eigenvalue).
std::vector<Wave> waves_of(const driver::Session& session, const FrozenPoint& point, double step,
                           const StateGroup& group = {});

}  // namespace dpde::stability
