// SPDX-License-Identifier: Apache-2.0
// The data of a task: from files that fit the grid, or states of other scenes' runs averaged onto it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "driver/scene/session.h"

namespace dpde::driver {

/// Reads every file that the problem names and reports those that are missing or do not fit.
void check_files(const model::Problem& problem, const SourceFile& source, DiagnosticSink& sink);

/// Means over the cells of `from` that make one of `to`; of those on its upper faces where the values lie on faces.
std::vector<double> average_down(const std::vector<double>& fine, const std::vector<model::Axis>& from,
                                 const std::vector<model::Axis>& to, const model::Placement& placement);

/// Field values sampled at the nearest cells of another grid.
std::vector<double> resample(const std::vector<double>& values, const std::vector<model::Axis>& from,
                             const std::vector<model::Axis>& to);

/// How the scene is compiled whose run makes a datum of a task.
CompileOptions options_of_maker(const Compiled& compiled, const model::Datum& datum);

/// Values between 0.5 and 1.5, in place of a file that is not read.
std::vector<double> made_up_values(std::size_t count);

/// Times of the states of a file that a coefficient is: of a control field where its intervals begin, else none.
std::vector<double> times_of(const model::Problem& problem, const model::Coefficient& coefficient);

/// A coefficient's values, or those it starts with, from the file of `from`, on the session's grid; of a control field
/// one interval after the other.
std::optional<std::vector<double>> load_coefficient(Session& session, const model::Coefficient& coefficient,
                                                    const model::Source& from, const SourceFile& source,
                                                    DiagnosticSink& sink);

/// The states of a datum of the session's task, as fields of its workspace; made-up values on another grid
/// than the scene's and for a datum without a file and scene.
std::optional<DataStates> load_datum(Session& session, const model::Datum& datum, const SourceFile& source,
                                     DiagnosticSink& sink);

}  // namespace dpde::driver
