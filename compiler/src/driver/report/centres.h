// SPDX-License-Identifier: Apache-2.0
// What lies on faces, at the centres of the cells: for programs that know no staggered values.
#pragma once

#include <string>
#include <vector>

#include "dpde/runtime/run_file.h"
#include "model/model.h"

namespace dpde::driver {

/// Means of the faces on both sides, of as many states as there are, one after the other, x fastest. Beside a wall that
/// holds no value in the array it is the boundary's where that is a number, else the line through the two next faces.
/// `axes`: the problem's with the cells of the values.
std::vector<double> at_centres(const model::Problem& problem, const std::vector<model::Axis>& axes,
                               const std::string& field, std::vector<double> values);
/// The files of the run have these too. The problem and the axes have to outlive it.
void add_centres(RunDescription& run, const model::Problem& problem, const std::vector<model::Axis>& axes);

}  // namespace dpde::driver
