// SPDX-License-Identifier: Apache-2.0
// What every gradient is checked by before it is used: the compiled adjoint of each program against the program's tangent on
// a few cells, by a dot product. The tangent is not compiled but interpreted: that costs less than differences would and,
// unlike these, is exact to rounding and has nothing to fear from kinks.
//
// A certificate is kept in the cache beside the code, under the code's key and the text of the programs: boundaries are no
// part of the code.
#pragma once

#include <optional>
#include <string>

#include "driver/pipeline.h"

namespace dpde::driver {

/// How far tangent and adjoint may differ in double and in single precision (see SinglePrecisionCheck). Over the tasks of
/// dsl-examples sound derivatives stay below 1e-14.
constexpr double largest_dot_error = 1e-11, largest_single_error = 1e-4;

enum class Certifying { when_cheap, always, never };

struct QuickCertificate {
  double dot_product = 0;  // the largest error of all programs and grids
  std::string program, grid;  // where
  bool from_cache = false;
  double seconds = 0;
};

/// nullopt: nothing was certified, as it would take more than a tenth of the compilation or no run was finite; or `sink` has
/// an error, as tangent and adjoint disagree. A failure is never kept.
std::optional<QuickCertificate> certify_quickly(const Compiled& compiled, Certifying how, DiagnosticSink& sink);

/// Seconds it is expected to take.
double expected_seconds(const Compiled& compiled);

}  // namespace dpde::driver
