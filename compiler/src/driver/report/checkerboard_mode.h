// SPDX-License-Identifier: Apache-2.0
// States that end as chessboards: what is too fine for the grid piles up in waves of fewer than four cells.
#pragma once

#include "driver/scene/session.h"

namespace dpde::driver {

/// A warning for each axis and state of the last run whose neighbours are unlike one another at its end, or have
/// nothing to do with one another, and were not so at its start, at the equation of the state.
void report_chessboards(Session& session, DiagnosticSink& sink);

}  // namespace dpde::driver
