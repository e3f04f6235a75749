// SPDX-License-Identifier: Apache-2.0
// Fresh names that cannot collide and stay readable: ux_bar, ux_bar_2, ux_bar_3 ...
#pragma once

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "support/assert.h"

namespace dpde {

/// For kernels and programs, whose names are words; those of components are not, u.x.
inline std::string without_dots(std::string name) {
  std::ranges::replace(name, '.', '_');
  return name;
}

/// "" for a number; .x, .y, .z for the components of a vector.
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

  /// Returns `wish` if it is free, otherwise the first free of wish_2, wish_3, ...; reserves what it returns.
  std::string fresh(const std::string& wish) {
    std::string name = wish;
    for (int n = 2; !used_.insert(name).second; ++n) name = wish + "_" + std::to_string(n);
    return name;
  }

  /// Of wish, wish_2, ... the first that is free with all suffixes; reserves it with each of them.
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
