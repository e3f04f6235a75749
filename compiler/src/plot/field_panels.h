// SPDX-License-Identifier: Apache-2.0
// States of fields of array files as panels of a picture.
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

/// Of cell `i` of the axis.
double centre_of(const StoredAxis& axis, std::int64_t i);

/// The state nearest to the time; the last where none is asked for.
std::size_t state_at(const StoredField& field, const std::optional<double>& time);

/// A line for one axis, a map for two, three planes for three: those through the middle, or the one that is meant.
void add_panels(const StoredField& field, std::size_t state, const std::optional<Slice>& slice,
                const std::optional<ValueRange>& range, std::vector<Panel>& panels);

/// Each state on a page, with a slice, or none, for each field. The frames of a film share a range, or each has its
/// own.
std::vector<std::vector<Panel>> pages_of(const std::vector<StoredField>& fields,
                                         const std::vector<std::optional<Slice>>& slices, bool shares_range);

}  // namespace dpde::plot
