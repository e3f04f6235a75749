// SPDX-License-Identifier: Apache-2.0
// States of fields from array files as panels of a picture.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "plot/picture.h"
#include "plot/stored_fields.h"

namespace dpde::plot {

/// A plane of a field on three axes.
struct Slice {
  std::size_t axis = 2;
  std::int64_t index = 0;
};

/// Centre of cell `i` of the axis.
double centre_of(const StoredAxis& axis, std::int64_t i);

/// The state nearest to `time`; the last one if none is given.
std::size_t state_at(const StoredField& field, const std::optional<double>& time);

/// Adds a curve for one axis, a map for two, and for three axes the given slice or the three middle planes.
void add_panels(const StoredField& field, std::size_t state, const std::optional<Slice>& slice,
                const std::optional<ValueRange>& range, std::vector<Panel>& panels);

/// A map of a field on one axis over this axis and time. There are at least two times.
MapPanel space_time_map(const StoredField& field);

/// One page for each state, with an optional slice for each field. Pages share one range, as in a film, or each has its
/// own.
std::vector<std::vector<Panel>> pages_of(const std::vector<StoredField>& fields,
                                         const std::vector<std::optional<Slice>>& slices, bool shares_range);

}  // namespace dpde::plot
