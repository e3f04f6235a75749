// SPDX-License-Identifier: Apache-2.0
// Names that every scene defines, for all levels.
#pragma once

#include <algorithm>
#include <iterator>
#include <string_view>

namespace dpde {

enum class BoundNameKind { coordinate, parameter };  // a field; a number

struct BoundName {
  std::string_view name;
  BoundNameKind kind;
  std::string_view meaning;  // for messages
  int axis = -1;             // of a coordinate
};

inline constexpr BoundName bound_names[] = {
    {"x", BoundNameKind::coordinate, "a coordinate", 0},
    {"y", BoundNameKind::coordinate, "a coordinate", 1},
    {"z", BoundNameKind::coordinate, "a coordinate", 2},
    {"hx", BoundNameKind::parameter, "the spacing along x"},
    {"hy", BoundNameKind::parameter, "the spacing along y"},
    {"hz", BoundNameKind::parameter, "the spacing along z"},
    {"t", BoundNameKind::parameter, "the time"},
    {"dt", BoundNameKind::parameter, "the time step"},
    {"cells", BoundNameKind::parameter, "the number of cells of the grid"},
};

/// nullptr for other names.
constexpr const BoundName* find_bound_name(std::string_view name) {
  const BoundName* found = std::ranges::find(bound_names, name, &BoundName::name);
  return found == std::end(bound_names) ? nullptr : found;
}

}  // namespace dpde
