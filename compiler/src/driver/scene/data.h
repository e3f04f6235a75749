// SPDX-License-Identifier: Apache-2.0
// Data of a task: from files on the same grid, or states of other scenes' runs averaged to it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "driver/scene/session.h"

namespace dpde::driver {

/// Reads every file that the problem names; reports those that are missing or do not fit.
void check_files(const model::Problem& problem, const SourceFile& source, DiagnosticSink& sink);

/// Means over the cells of `from` that form one cell of `to`; for face values, over the cells at its upper face.
std::vector<double> average_down(const std::vector<double>& fine, const std::vector<model::Axis>& from,
                                 const std::vector<model::Axis>& to, const model::Placement& placement);

/// Field values taken from the nearest cells of another grid.
std::vector<double> resample(const std::vector<double>& values, const std::vector<model::Axis>& from,
                             const std::vector<model::Axis>& to);

/// Options to compile the scene whose run makes a datum of a task.
CompileOptions options_of_maker(const Compiled& compiled, const model::Datum& datum);

/// Values between 0.5 and 1.5, used instead of a file.
std::vector<double> made_up_values(std::size_t count);

/// Times of the states in a coefficient's file: for a control field the begins of its intervals, else none.
std::vector<double> times_of(const model::Problem& problem, const model::Coefficient& coefficient);

/// Values of a coefficient from the file of `from`, on the session's grid; for a control field, interval after
/// interval.
std::optional<std::vector<double>> load_coefficient(Session& session, const model::Coefficient& coefficient,
                                                    const model::Source& from, const SourceFile& source,
                                                    DiagnosticSink& sink);

/// States of a datum of the session's task, as fields of its workspace. Made-up values on a grid other than the
/// scene's, and for a datum without a file and scene.
std::optional<DataStates> load_datum(Session& session, const model::Datum& datum, const SourceFile& source,
                                     DiagnosticSink& sink);

}  // namespace dpde::driver
