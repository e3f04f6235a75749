// SPDX-License-Identifier: Apache-2.0
// Checks the gradient of a whole short run of a task, on a few cells, against difference quotients of the run's losses.
// The gradient is computed as for the task: compiled programs, their adjoints, rollout, formulas, losses, controls,
// shared ghost cells, and links of derivative arrays. Quotients need no derivatives, so they also detect errors common
// to tangent and adjoint.
// that is wrong in the tangent and in the adjoint alike is hidden from them.
//
// Each unknown has its own direction, so that none hides another; if time is short, one direction covers all of them.
// No file is read: the values of files are made up.
//
// For runs until steady, it checks the gradient of the steady state with losses of runs that end there; their
// uncertainty, from the tolerance of until steady, counts as rounding. If such a run does not end on a few cells, or
// takes too long, a short run is checked instead and this is reported.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "driver/compile/pipeline.h"

namespace dpde::analysis {

struct RunCheck {
  std::string grid;  // "" if no run was made
  int steps = 0;
  std::string window;                 // its start, "" for the scene's own start
  bool is_steady = false;             // run until steady, with the gradient of the steady state
  int directions = 0;                 // number that prove the gradient
  std::string unknown;                // the one with the largest error, or "all unknowns"
  double error = 0;                   // of the quotients, relative to the derivative
  double rounding = 0;                // largest rounding of one of them
  std::vector<std::string> left_out;  // parts not checked, and why
  std::vector<std::string> untested;  // unknowns for which no direction proves the gradient
  std::string wrong;                  // not empty: the quotients converge to another number
  bool lacked_time = false;
  bool is_in_doubt = false;  // they do so at one point, and no other point was finite
  bool stops_early = false;  // they do so while a solve leaves more than rounding
};

/// Names of the task's unknowns, as in `untested`.
std::vector<std::string> unknowns_of(const driver::Compiled& compiled);

/// Possible reasons for a derivative of exactly 0. No test can tell which applies, or whether 0 is right.
std::string causes_of_zero(const driver::Compiled& compiled);

/// Residuals of solves that stop early are no fault of a gradient. If there are such solves and quotients and gradient
/// differ, `wrong` is the result with those solves completed. Takes about `seconds`, or twice that, and reports parts
/// left out for lack of time.
RunCheck check_run(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& compiled, double seconds);

}  // namespace dpde::analysis
