// SPDX-License-Identifier: Apache-2.0
// What the files of a run say of it beside its values.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "dpde/runtime/run_file.h"
#include "model/model.h"
#include "source/source_file.h"

namespace dpde::driver {

/// What makes a result again: `dpde VERB FILE NAME` with its options.
struct RunOrigin {
  std::string verb = "run";
  std::string file, name;
  std::vector<std::string> set;  // NAME=VALUE
  std::string scheme, backend;
  std::uint64_t seed = 0;
};

/// What readers call an axis: lon of x on a sphere.
std::string called(const model::Problem& problem, const std::string& axis);
/// Where a state or what is shown lies.
model::Placement placement_of(const model::Problem& problem, const std::string& field);

/// For record_plan().
std::vector<Series> run_outputs(const model::Problem& problem);
std::vector<RunAxis> run_axes(const model::Problem& problem, const std::vector<model::Axis>& axes);
/// All parameters that are one number in a whole run.
std::vector<RunNumber> run_params(const model::Problem& problem);
/// Names that variables of the user have.
std::set<std::string> taken_names(const model::Problem& problem);
/// Of the file: text, settings and numbers.
NetcdfAttributes attributes_of(const model::Problem& problem, const SourceFile& source, const RunOrigin& origin);
/// `axes`: the problem's with other cells. `states`: what a run steps, with what schemes and solves keep.
RunDescription describe_run(const model::Problem& problem, const std::vector<model::Axis>& axes,
                            const std::vector<std::string>& states, const SourceFile& source, const RunOrigin& origin);

}  // namespace dpde::driver
