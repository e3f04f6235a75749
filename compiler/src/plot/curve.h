// SPDX-License-Identifier: Apache-2.0
// A field on one axis as a line with no more points than show.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "plot/picture.h"

namespace dpde::plot {

/// The values as a curve. Of very many, those that decide what is drawn are kept: of each of as many equal parts as
/// no picture has columns the first, the last, the smallest and the largest, and one that is not finite.
Curve curve_of(std::string title, std::span<const double> values, const std::function<double(std::size_t)>& place);

}  // namespace dpde::plot
