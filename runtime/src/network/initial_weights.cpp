// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "dpde/runtime/network.h"
#include "dpde/runtime/random.h"

namespace dpde {
namespace {

constexpr std::uint64_t stream = 0x6e6574776f726b;  // a stream that no other random numbers of a simulation use

/// Uniform between -1 and 1.
double uniform(std::uint64_t seed, std::uint64_t place) {
  const auto low = [](std::uint64_t value) { return static_cast<std::uint32_t>(value); };
  const auto high = [](std::uint64_t value) { return static_cast<std::uint32_t>(value >> 32); };
  const auto words = philox({low(place), high(place), low(stream), high(stream)}, {low(seed), high(seed)});
  const std::uint64_t bits = (std::uint64_t{words[1]} << 32 | words[0]) >> 11;
  return (static_cast<double>(bits) + 0.5) * 0x1p-52 - 1;
}

}  // namespace

std::vector<double> initial_weights(const dpde_network& network, std::uint64_t seed) {
  std::vector<double> weights(static_cast<std::size_t>(network.weight_count), 0.0);
  std::vector<std::int32_t> channels{network.inputs};
  for (std::int32_t k = 0; k < network.layer_count; ++k) {
    const dpde_layer& layer = network.layers[k];
    channels.push_back(layer.channels);
    if (layer.kind != DPDE_CONV || layer.init == DPDE_INIT_ZERO) continue;
    std::int64_t taps = 1;
    for (std::int32_t axis = 0; axis < network.rank; ++axis) taps *= layer.extent;
    const std::int64_t inputs = channels[static_cast<std::size_t>(layer.input)] / layer.groups,
                       count = inputs * taps * layer.channels;
    const auto fan_in = static_cast<double>(inputs * taps),
               fan_out = static_cast<double>(layer.channels / layer.groups * taps);
    for (std::int64_t i = 0; i < count; ++i) {
      const auto place = static_cast<std::uint64_t>(layer.weights + i);
      weights[place] = layer.init == DPDE_INIT_HE
                           ? layer.gain * std::sqrt(2 / fan_in) * normal(seed, place, stream)
                           : layer.gain * std::sqrt(6 / (fan_in + fan_out)) * uniform(seed, place);
    }
  }
  return weights;
}

}  // namespace dpde
