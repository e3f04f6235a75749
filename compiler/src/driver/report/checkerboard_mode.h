// SPDX-License-Identifier: Apache-2.0
// Detects states that end as a checkerboard: scales too fine for the grid pile up in waves of fewer than four cells.
#pragma once

#include "driver/scene/session.h"

namespace dpde::driver {

/// Warns for each axis and state of the last run whose neighbours are anticorrelated or uncorrelated at the end, but
/// were not at the start. The warning is at the state's equation.
void report_chessboards(Session& session, DiagnosticSink& sink);

}  // namespace dpde::driver
