// SPDX-License-Identifier: Apache-2.0
// Fresh names that cannot collide and stay readable: ux_bar, ux_bar_2, ux_bar_3 ...
#pragma once

#include <algorithm>
#include <set>
#include <string>

namespace dpde {

/// For kernels and programs, whose names are words; those of components are not, u.x.
inline std::string without_dots(std::string name) {
  std::ranges::replace(name, '.', '_');
  return name;
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

 private:
  std::set<std::string> used_;
};

}  // namespace dpde
