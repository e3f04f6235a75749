// SPDX-License-Identifier: Apache-2.0
// Numbers beside axes that differ from one another.
#pragma once

#include "plot/picture.h"

namespace dpde::plot {

/// If the values vary by less than a thousandth of their size, six digits do not tell them apart: a round number is
/// subtracted from them, and the label says which.
LinePanel with_readable_values(LinePanel panel);
MapPanel with_readable_values(MapPanel panel);

}  // namespace dpde::plot
