// SPDX-License-Identifier: Apache-2.0
// Membership in a short list of names.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

namespace dpde {

inline bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace dpde
