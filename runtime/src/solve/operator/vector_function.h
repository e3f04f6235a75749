// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>

namespace dpde {

/// From a vector to another one of as many numbers.
using VectorFunction = std::function<void(std::span<const double>, std::span<double>)>;

}  // namespace dpde
