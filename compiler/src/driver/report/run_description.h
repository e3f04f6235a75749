// SPDX-License-Identifier: Apache-2.0
// Description of a run that its files contain in addition to values.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "dpde/runtime/run_file.h"
#include "model/model.h"
#include "source/source_file.h"

namespace dpde::driver {

/// Command that reproduces a result: `dpde VERB FILE NAME` with its options.
struct RunOrigin {
  std::string verb = "run";
  std::string file, name;
  std::vector<std::string> set;  // NAME=VALUE
  std::string scheme, backend;
  std::uint64_t seed = 0;
};

/// Conventional name of an axis: lon for x on a sphere.
std::string called(const model::Problem& problem, const std::string& axis);
/// Placement of a state or a shown field.
model::Placement placement_of(const model::Problem& problem, const std::string& field);

/// For record_plan().
std::vector<Series> run_outputs(const model::Problem& problem);
std::vector<RunAxis> run_axes(const model::Problem& problem, const std::vector<model::Axis>& axes);
/// All parameters that are constant during a run.
std::vector<RunNumber> run_params(const model::Problem& problem);
/// Names used by the user's variables.
std::set<std::string> taken_names(const model::Problem& problem);
/// Attributes of the file: text, settings and numbers.
NetcdfAttributes attributes_of(const model::Problem& problem, const SourceFile& source, const RunOrigin& origin);
/// `axes`: the problem's axes with other cell counts. `states`: all states of the run's steps, with those of schemes
/// and solves.
RunDescription describe_run(const model::Problem& problem, const std::vector<model::Axis>& axes,
                            const std::vector<std::string>& states, const SourceFile& source, const RunOrigin& origin);

}  // namespace dpde::driver
