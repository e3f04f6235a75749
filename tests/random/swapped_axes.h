// SPDX-License-Identifier: Apache-2.0
// The text of a random model with its first two axes swapped: its results must be transposed and otherwise equal.
#pragma once

#include <optional>
#include <string>

namespace dpde::testing {

/// nullopt if there are fewer than two axes, or if random numbers are drawn cell by cell.
std::optional<std::string> with_swapped_axes(const std::string& text);

}  // namespace dpde::testing
