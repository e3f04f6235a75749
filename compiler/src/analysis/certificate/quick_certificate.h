// SPDX-License-Identifier: Apache-2.0
// Checks on a few cells that every gradient passes before it is used:
//
// - Each program's compiled adjoint against its tangent, by a dot product. The tangent is interpreted, not compiled:
//   this costs less than differences, is exact to rounding and is not affected by kinks. If they differ, a compiled
//   tangent decides.
// - The gradient of a whole short run against difference quotients of its losses (run_check.h). These also detect
//   errors between programs (formulas, losses, controls, shared ghost cells, links), and errors common to tangent and
//   adjoint.
//
// Both together take less than a tenth of the compilation time (for quick code: of that for optimised code), or report
// what was left out. The certificate is cached with the code. Its key is the code's key, the text of the programs, and
// the scene and its task, which are not part of the code.
#pragma once

#include <optional>
#include <string>

#include "analysis/certificate/run_check.h"
#include "driver/compile/pipeline.h"

namespace dpde::analysis {

/// Allowed difference of tangent and adjoint in double and in single precision (see SinglePrecisionCheck). In the tasks
/// of dsl-examples correct derivatives stay below 1e-14.
constexpr double largest_dot_error = 1e-11, largest_single_error = 1e-4;

enum class Certifying { when_cheap, always, never };

struct QuickCertificate {
  double dot_product = 0;     // largest error over all programs and grids
  std::string program, grid;  // of that error; "" if nothing was compared
  RunCheck run;
  std::vector<std::string> left_out;  // parts not checked, and why; includes those of the run
  bool from_cache = false;
  double seconds = 0;
};

/// nullopt if it is not requested, if there is no compiled code, or with an error in `sink` if tangent and adjoint, or
/// gradient and losses disagree. Failures are not cached, nor certificates that lacked time: the same call fails again.
std::optional<QuickCertificate> certify_quickly(const SourceFile& source,
                                                const std::shared_ptr<const driver::Compiled>& compiled, Certifying how,
                                                DiagnosticSink& sink);

/// Expected CPU seconds of the dot-product part.
double expected_seconds(const driver::Compiled& compiled);

}  // namespace dpde::analysis
