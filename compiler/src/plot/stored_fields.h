// SPDX-License-Identifier: Apache-2.0
// Fields from array files for drawing: a name, coordinates along each axis, and one state for each time.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/model.h"
#include "source/diagnostic.h"

namespace dpde::plot {

struct StoredAxis {
  std::string name;
  double low = 0, high = 1;  // its ends
  std::int64_t cells = 1;
  std::vector<double> faces = {};  // for cells of different widths, one more than cells; else empty
  std::string unit = {};           // "": unknown
  /// Of values on faces: the ends of the grid.
  std::optional<std::pair<double, double>> grid = {};
};
struct StoredField {
  std::string name;
  std::vector<StoredAxis> axes;  // 1 to 3, x first
  std::vector<double> times;     // empty: one state without a time
  std::vector<std::vector<double>> states;
  std::string unit = {}, time_unit = {};
  std::optional<model::CoordinateSystem> system = {};  // of curved coordinates
};

/// One field of a .npy file, or fields of a .nc file: `field`, or all on the axes of the first one (""). Only the last
/// state unless `all_states`. Returns nullopt after a diagnostic.
std::optional<std::vector<StoredField>> load_fields(const std::string& path, const std::string& field, bool all_states,
                                                    DiagnosticSink& sink);

}  // namespace dpde::plot
