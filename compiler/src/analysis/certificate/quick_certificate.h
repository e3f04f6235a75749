// SPDX-License-Identifier: Apache-2.0
// What every gradient is checked by before it is used, on a few cells:
//
//  - the compiled adjoint of each program against the program's tangent, by a dot product. The tangent is not
//    compiled but interpreted: that costs less than differences would and, unlike these, is exact to rounding and
//    has nothing to fear from kinks. Where they differ, a compiled tangent decides;
//  - the gradient of a whole short run against difference quotients of its losses (run_check.h), which see what
//    lies between the programs: formulas, losses, controls, halos that programs share, links, and what tangent and
//    adjoint have wrong alike.
//
// Both together take less than a tenth of the compilation (for code that is not optimised: of what optimised code would
// take), or say what was left out. A certificate is kept in the cache beside the code, under the code's key, the text
// of the programs and that of the scene and its task, which are no part of the code.
#pragma once

#include <optional>
#include <string>

#include "analysis/certificate/run_check.h"
#include "driver/compile/pipeline.h"

namespace dpde::analysis {

/// How far tangent and adjoint may differ in double and in single precision (see SinglePrecisionCheck). Over the tasks
/// of dsl-examples sound derivatives stay below 1e-14.
constexpr double largest_dot_error = 1e-11, largest_single_error = 1e-4;

enum class Certifying { when_cheap, always, never };

struct QuickCertificate {
  double dot_product = 0;     // the largest error of all programs and grids
  std::string program, grid;  // where; "" where nothing was compared
  RunCheck run;
  std::vector<std::string> left_out;  // what was not checked, and why: what the run left out too
  bool from_cache = false;
  double seconds = 0;
};

/// nullopt: it is not wanted, or there is no compiled code; or `sink` has an error, as tangent and adjoint or gradient
/// and losses disagree. A failure is not kept, nor a certificate that lacked time: the same call fails again.
std::optional<QuickCertificate> certify_quickly(const SourceFile& source,
                                                const std::shared_ptr<const driver::Compiled>& compiled, Certifying how,
                                                DiagnosticSink& sink);

/// Seconds that its first part is expected to take.
double expected_seconds(const driver::Compiled& compiled);

}  // namespace dpde::analysis
