// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>

namespace dpde {

/// Maps a vector to another one of the same length.
using VectorFunction = std::function<void(std::span<const double>, std::span<double>)>;

}  // namespace dpde
