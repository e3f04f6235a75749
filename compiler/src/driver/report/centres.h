// SPDX-License-Identifier: Apache-2.0
// Interpolates face values to cell centres, for programs that do not support staggered values.
#pragma once

#include <string>
#include <vector>

#include "dpde/runtime/run_file.h"
#include "model/model.h"

namespace dpde::driver {

/// Means of the two adjacent faces, x fastest, state after state. If the array has no value on a wall, the boundary's
/// value is used if it is a number, else linear extrapolation from the next two faces. `axes`: the problem's axes with
/// the cells of the values.
std::vector<double> at_centres(const model::Problem& problem, const std::vector<model::Axis>& axes,
                               const std::string& field, std::vector<double> values);
/// Adds centre values to the files of the run. The problem and the axes must outlive it.
void add_centres(RunDescription& run, const model::Problem& problem, const std::vector<model::Axis>& axes);

}  // namespace dpde::driver
