// SPDX-License-Identifier: Apache-2.0
// Fields of array files as they are drawn: a name, places along each axis, and one state for each time.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "source/diagnostic.h"

namespace dpde::plot {

struct StoredAxis {
  std::string name;
  double low = 0, high = 1;  // its ends
  std::int64_t cells = 1;
  std::vector<double> faces = {};  // of cells of different widths, one more than cells; empty where they are uniform
  std::string unit = {};           // "": not known
};
struct StoredField {
  std::string name;
  std::vector<StoredAxis> axes;  // x first; 1 to 3
  std::vector<double> times;     // empty: one state without a time
  std::vector<std::vector<double>> states;
  std::string unit = {}, time_unit = {};
};

/// One field of a .npy file, or those of a .nc file: `field`, or ("") all on the axes of the first. Only the last state
/// unless `all_states`. nullopt after a diagnostic.
std::optional<std::vector<StoredField>> load_fields(const std::string& path, const std::string& field, bool all_states,
                                                    DiagnosticSink& sink);

}  // namespace dpde::plot
