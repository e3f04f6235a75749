// SPDX-License-Identifier: Apache-2.0
#include "network/symmetrise.h"

#include <algorithm>
#include <cstdlib>

namespace dpde::network {
namespace {

constexpr Orientation as_it_is{1, 2, 3};

std::size_t axis_of(int signed_axis) { return static_cast<std::size_t>(std::abs(signed_axis)) - 1; }

/// Composition: `first`, then `second`.
Orientation product(const Orientation& first, const Orientation& second) {
  Orientation result{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    result[axis] = (second[axis] < 0 ? -1 : 1) * first[axis_of(second[axis])];
  return result;
}

Orientation inverse(const Orientation& orientation) {
  Orientation result{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int number = static_cast<int>(axis) + 1;
    result[axis_of(orientation[axis])] = orientation[axis] < 0 ? -number : number;
  }
  return result;
}

/// The channels' order as Layer::order.
std::vector<int> order_of(const Orientation& orientation, const std::vector<bool>& vectors, int rank) {
  std::vector<int> order;
  bool changes = false;
  for (const bool vector : vectors) {
    const int first = static_cast<int>(order.size());
    if (!vector) order.push_back(first + 1);
    for (int axis = 0; vector && axis < rank; ++axis) {
      const int from = orientation[static_cast<std::size_t>(axis)];
      order.push_back(from < 0 ? from - first : from + first);
      changes = changes || from != axis + 1;
    }
  }
  return changes ? order : std::vector<int>{};
}

class Copies {
 public:
  Copies(const Network& network, const Symmetry& symmetry)
      : network_(network), symmetry_(symmetry), is_pointwise_(is_pointwise(network)), result_(network) {}

  Network run() {
    int sum = last();
    for (const Orientation& orientation : group_of(symmetry_.generators)) {
      if (!is_new(orientation)) continue;
      const int image = reorient(0, orientation, symmetry_.inputs);
      const int made = reorient(copy_layers(image), inverse(orientation), symmetry_.outputs);
      Layer add{.kind = LayerKind::add, .input = sum, .other = made, .channels = network_.outputs};
      sum = push(add);
    }
    if (acts_.size() > 1)
      push({.kind = LayerKind::scale,
            .input = sum,
            .channels = network_.outputs,
            .factor = 1.0 / static_cast<double>(acts_.size())});
    return std::move(result_);
  }

 private:
  /// Effect of an orientation on cells and channels. Several have the same effect if there are no vectors and no
  /// neighbours.
  struct Act {
    Orientation axes = as_it_is;
    std::vector<int> inputs, outputs;
    bool operator==(const Act&) const = default;
  };

  bool is_new(const Orientation& orientation) {
    const Act act{axes(orientation), order_of(orientation, symmetry_.inputs, network_.rank()),
                  order_of(orientation, symmetry_.outputs, network_.rank())};
    if (std::ranges::find(acts_, act) != acts_.end()) return false;
    acts_.push_back(act);
    return true;
  }

  /// Pointwise networks need no reordering of cells.
  Orientation axes(const Orientation& orientation) const { return is_pointwise_ ? as_it_is : orientation; }

  int last() const { return static_cast<int>(result_.layers.size()); }
  int push(const Layer& layer) {
    result_.layers.push_back(layer);
    return last();
  }

  int reorient(int input, const Orientation& orientation, const std::vector<bool>& vectors) {
    Layer layer{.kind = LayerKind::reorient,
                .input = input,
                .channels = channels_of(result_, input),
                .axes = axes(orientation)};
    layer.order = order_of(orientation, vectors, network_.rank());
    if (layer.axes == as_it_is && layer.order.empty()) return input;
    return push(layer);
  }

  int copy_layers(int input) {
    const int before = last();
    const auto moved = [&](int value) { return value == 0 ? input : value + before; };
    for (std::size_t i = 0; i < network_.layers.size(); ++i) {
      Layer layer = network_.layers[i];
      if (layer.kind == LayerKind::conv && layer.weights_of == 0) layer.weights_of = static_cast<int>(i) + 1;
      layer.input = moved(layer.input);
      if (layer.other >= 0) layer.other = moved(layer.other);
      push(layer);
    }
    return last();
  }

  const Network& network_;
  const Symmetry& symmetry_;
  bool is_pointwise_;
  Network result_;
  std::vector<Act> acts_{Act{}};  // begins with the network itself
};

}  // namespace

std::vector<Orientation> group_of(const std::vector<Orientation>& generators) {
  std::vector<Orientation> group{as_it_is};
  for (std::size_t i = 0; i < group.size(); ++i) {
    for (const Orientation& generator : generators) {
      const Orientation next = product(group[i], generator);
      if (std::ranges::find(group, next) == group.end()) group.push_back(next);
    }
  }
  return group;
}

std::vector<int> grid_for(const std::vector<Network>& networks, std::vector<int> cells) {
  const std::vector<int> before = cells;
  for (const Network& network : networks) {
    for (const Layer& layer : network.layers) {
      for (std::size_t axis = 0; axis < cells.size(); ++axis) {
        int& from = cells[axis_of(layer.axes[axis])];
        cells[axis] = from = std::max(cells[axis], from);
      }
    }
  }
  return cells == before ? cells : grid_for(networks, cells);
}

Network symmetrised(const Network& network, const Symmetry& symmetry) { return Copies(network, symmetry).run(); }

}  // namespace dpde::network
