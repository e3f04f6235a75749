// SPDX-License-Identifier: Apache-2.0
// Runs that end far above where they began, and would go on so: finite, but not stable.
#pragma once

#include <string>
#include <vector>

#include "dpde/runtime/engine.h"

namespace dpde {

/// So many times above where it began a state may be one that grows without bounds: whether it grows on is looked at.
constexpr double suspicious_growth = 1e8;

/// Nothing of the world grows by so much, or is so large in units that anybody takes. From next to nothing to what
/// drives it anything may.
inline bool grows_beyond_reason(double before, double after) {
  return before > 0 && after > 1e50 * (before > 1 ? before : 1);
}

struct Growth {
  std::string state;
  double before = 0, after = 0;  // largest magnitudes
  bool is_beyond_reason() const { return grows_beyond_reason(before, after); }
};

/// Of the interior; nothing of the size of the field is made.
double largest_magnitude(const dpde_layout& layout, const void* base);

/// The states of a run that has ended at `t` with `end`, base pointers, after `steps` steps, `suspicious` times above
/// `before`, the largest magnitudes of where it began, and that grow on: another step is made from there.
std::vector<Growth> growths_of(Engine& engine, const std::vector<double>& before, const std::vector<void*>& end,
                               int steps, double t, double suspicious = suspicious_growth);

}  // namespace dpde
