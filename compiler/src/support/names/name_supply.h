// SPDX-License-Identifier: Apache-2.0
// Unused, readable names: ux_bar, ux_bar_2, ux_bar_3 ...
#pragma once

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "support/assert.h"

namespace dpde {

/// For names of kernels and programs, which must be words; component names such as u.x are not.
inline std::string without_dots(std::string name) {
  std::ranges::replace(name, '.', '_');
  return name;
}

/// "" for a scalar; .x, .y, .z for the components of a vector.
inline std::vector<std::string> component_suffixes(std::size_t count) {
  require(count <= 3, "a vector has up to three components");
  if (count == 1) return {""};
  std::vector<std::string> suffixes;
  for (std::size_t i = 0; i < count; ++i) suffixes.push_back(std::string(".") + "xyz"[i]);
  return suffixes;
}

class NameSupply {
 public:
  void reserve(const std::string& name) { used_.insert(name); }
  bool is_used(const std::string& name) const { return used_.contains(name); }

  /// Returns `wish` if it is unused, otherwise the first unused of wish_2, wish_3, ...; marks the result as used.
  std::string fresh(const std::string& wish) {
    std::string name = wish;
    for (int n = 2; !used_.insert(name).second; ++n) name = wish + "_" + std::to_string(n);
    return name;
  }

  /// Returns the first of wish, wish_2, ... that is unused with every suffix; marks all of these as used.
  std::string fresh_stem(const std::string& wish, const std::vector<std::string>& suffixes) {
    const auto is_free = [&](const std::string& stem) {
      return std::ranges::none_of(suffixes, [&](const std::string& suffix) { return is_used(stem + suffix); });
    };
    std::string stem = wish;
    for (int n = 2; !is_free(stem); ++n) stem = wish + "_" + std::to_string(n);
    for (const std::string& suffix : suffixes) reserve(stem + suffix);
    return stem;
  }

 private:
  std::set<std::string> used_;
};

}  // namespace dpde
