// SPDX-License-Identifier: Apache-2.0
// The text of a random model whose first two axes have changed places: what it computes is mirrored, and no more.
#pragma once

#include <optional>
#include <string>

namespace dpde::testing {

/// nullopt where there are fewer than two axes, or where numbers are drawn cell by cell.
std::optional<std::string> with_swapped_axes(const std::string& text);

}  // namespace dpde::testing
