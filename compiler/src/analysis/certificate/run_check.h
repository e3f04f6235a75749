// SPDX-License-Identifier: Apache-2.0
// The gradient of a whole short run of a task, on a few cells, against difference quotients of the run's own losses.
// The gradient is the one that the task gets: compiled programs, their adjoints, rollout, formulas, losses, controls,
// halos that programs share, and which array is whose derivative. The quotients know nothing of derivatives, so nothing
// that is wrong in the tangent and in the adjoint alike is hidden from them.
//
// Each unknown has a direction of its own, so that none hides behind another; where there is no time for that, one
// direction is in all of them. No file is read: what files hold is made up.
//
// Of runs until steady it is the gradient of the steady state, and losses are of runs that end there: what these know
// of it, by the tolerance of until steady, counts as rounding. Where such a run comes to no end on a few cells, or
// takes too long, a short run is checked, and that is said.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "driver/compile/pipeline.h"

namespace dpde::analysis {

struct RunCheck {
  std::string grid;  // "" where no run was made
  int steps = 0;
  std::string window;      // where it begins, "" for the scene's own start
  bool is_steady = false;  // it goes on until the state is steady, and the gradient is that of the steady state
  int directions = 0;      // that prove the gradient
  std::string unknown;     // the one with the largest error, or "all unknowns"
  double error = 0;        // of the quotients, relative to the derivative
  double rounding = 0;     // the largest that rounding may make of one of them
  std::vector<std::string> left_out;  // what was not checked, and why
  std::vector<std::string> untested;  // unknowns that no direction proves the gradient by
  std::string wrong;                  // not empty: the quotients agree on another number
  bool lacked_time = false;
  bool is_in_doubt = false;  // they do so at one point, and no other one was finite
  bool stops_early = false;  // they do so where a solve leaves more than rounding
};

/// Of its task, as `untested` has them.
std::vector<std::string> unknowns_of(const driver::Compiled& compiled);

/// Why a derivative may be exactly 0: no test tells which of these it is, or whether it should be.
std::string causes_of_zero(const driver::Compiled& compiled);

/// What solves that are stopped early have left is no fault of a gradient: where one was, and quotients and gradient
/// differ, `wrong` is what they come to where those solves are done. Takes about `seconds`, or there again, and says
/// what it has left out for lack of time.
RunCheck check_run(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& compiled, double seconds);

}  // namespace dpde::analysis
