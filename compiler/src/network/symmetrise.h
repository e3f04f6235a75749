// SPDX-License-Identifier: Apache-2.0
// Makes networks equivariant under rotations and reflections of the grid.
#pragma once

#include <array>
#include <vector>

#include "network/network.h"

namespace dpde::network {

/// A rotation or reflection of the grid: for each axis of the image the original axis, counted from 1, negative for
/// reversed. Same as Layer::axes; vector components transform likewise.
using Orientation = std::array<int, 3>;

struct Symmetry {
  std::vector<Orientation> generators;  // of the group
  std::vector<bool> inputs, outputs;    // whether each is a vector, with one channel for each axis
};

/// All products of the generators; the identity first.
std::vector<Orientation> group_of(const std::vector<Orientation>& generators);

/// Mean over the group of the network applied to a transformed input, transformed back. It is equivariant for any
/// weights. All copies share the weights of the network, whose layers come first and are unchanged.
Network symmetrised(const Network& network, const Symmetry& symmetry);

/// Returns `cells`, or more cells along axes that a network exchanges with others.
std::vector<int> grid_for(const std::vector<Network>& networks, std::vector<int> cells);

}  // namespace dpde::network
