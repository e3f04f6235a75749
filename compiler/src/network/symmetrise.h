// SPDX-License-Identifier: Apache-2.0
// Networks that turn and mirror what they make when what goes in is turned and mirrored.
#pragma once

#include <array>
#include <vector>

#include "network/network.h"

namespace dpde::network {

/// A turn or mirror image of the grid: the axis, from 1 on, that lies along each axis of the image, negative:
/// backwards. What Layer::axes says, which is also what becomes of the components of a vector.
using Orientation = std::array<int, 3>;

struct Symmetry {
  std::vector<Orientation> generators;  // the group is all that they make
  std::vector<bool> inputs, outputs;    // for each whether it is a vector, of as many channels as axes, or a number
};

/// All that the generators make, that which changes nothing first.
std::vector<Orientation> group_of(const std::vector<Orientation>& generators);

/// The mean over the group of what the network makes of an image, turned back: the image of the inputs gives the image
/// of the outputs, whatever the weights. All copies have the weights of the network, whose layers come first and stay
/// as they are.
Network symmetrised(const Network& network, const Symmetry& symmetry);

/// The grid of these cells, or one with more cells along axes that a network exchanges with others.
std::vector<int> grid_for(const std::vector<Network>& networks, std::vector<int> cells);

}  // namespace dpde::network
