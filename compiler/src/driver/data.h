// SPDX-License-Identifier: Apache-2.0
// Arrays from outside: .npy files that must fit the grid, and states of other scenes' runs averaged onto it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "driver/session.h"

namespace dpde::driver {

/// Values for a grid from a .npy file, x fastest. `states` > 0: that many states, one after the other, along a leading
/// axis of the file. Reports cannot-read, bad-array-file, wrong-shape and data-not-finite at `where`.
std::optional<std::vector<double>> load_array(const std::string& file, const SourceFile& source,
                                              const std::vector<model::Axis>& axes, int states, SourceRange where,
                                              DiagnosticSink& sink);

/// Field values sampled at the nearest cells of another grid.
std::vector<double> resample(const std::vector<double>& values, const std::vector<model::Axis>& from,
                             const std::vector<model::Axis>& to);

/// The states of a datum of the session's task, as fields of its workspace; made-up values on another grid
/// than the scene's and for a datum without a file and scene.
std::optional<DataStates> load_datum(Session& session, const model::Datum& datum, const SourceFile& source, DiagnosticSink& sink);

}  // namespace dpde::driver
