// SPDX-License-Identifier: Apache-2.0
// Detects runs that end far above their initial state and still grow: finite, but unstable.
#pragma once

#include <string>
#include <vector>

#include "dpde/runtime/engine.h"

namespace dpde {

/// A state that has grown by this factor may be unstable: the runtime checks whether it still grows.
constexpr double suspicious_growth = 1e8;

/// No physical quantity grows by 1e50 or is that large in common units. Growth from almost 0 to the size of a forcing
/// is allowed, hence max(before, 1).
inline bool grows_beyond_reason(double before, double after) {
  return before > 0 && after > 1e50 * (before > 1 ? before : 1);
}

struct Growth {
  std::string state;
  double before = 0, after = 0;  // largest magnitudes
  bool is_beyond_reason() const { return grows_beyond_reason(before, after); }
};

/// Largest magnitude in the interior; allocates nothing of the size of a field.
double largest_magnitude(const dpde_layout& layout, const void* base);

/// The states that end `suspicious` times above `before`, the largest magnitudes of the initial state, and that still
/// grow in one more step. `end`: base pointers of the states at `t`, after `steps` steps.
std::vector<Growth> growths_of(Engine& engine, const std::vector<double>& before, const std::vector<void*>& end,
                               int steps, double t, double suspicious = suspicious_growth);

}  // namespace dpde
