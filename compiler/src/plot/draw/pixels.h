// SPDX-License-Identifier: Apache-2.0
// Maps as the equal pixels that a picture has.
#pragma once

#include "plot/picture.h"

namespace dpde::plot {

/// The map on equal pixels in a plane, at most as many as a picture has, with coordinates that increase to the right
/// and upwards. Coordinates of a sphere become degrees; a map over r and theta becomes a disc, ring or sector, with no
/// values (NaN) outside of it. Lines follow.
MapPanel with_pixels(MapPanel panel);

}  // namespace dpde::plot
