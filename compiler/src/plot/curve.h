// SPDX-License-Identifier: Apache-2.0
// A field on one axis as a curve with no more points than are visible.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "plot/picture.h"

namespace dpde::plot {

/// The values as a curve. Long arrays are thinned without visible change: they are split into more equal parts than
/// pictures have columns, and of each part the first, last, smallest and largest value and one that is not finite are
/// kept.
Curve curve_of(std::string title, std::span<const double> values, const std::function<double(std::size_t)>& place);

}  // namespace dpde::plot
