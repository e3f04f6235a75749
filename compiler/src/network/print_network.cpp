// SPDX-License-Identifier: Apache-2.0
#include "network/print_network.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdlib>

namespace dpde::network {
namespace {

constexpr const char* axis_names[] = {"x", "y", "z"};

std::string value_name(int number) { return number == 0 ? "in" : fmt::format("v{}", number); }

/// Options that differ from the default.
std::string conv_options(const Layer& layer) {
  std::string text;
  if (layer.stride != 1) text += fmt::format(", stride = {}", layer.stride);
  if (layer.dilation != 1) text += fmt::format(", dilation = {}", layer.dilation);
  if (layer.groups != 1) text += fmt::format(", groups = {}", layer.groups);
  if (layer.weights_of > 0) return text + fmt::format(", weights = {}", value_name(layer.weights_of));
  if (!layer.bias) text += ", bias = 0";
  if (layer.gain != 1) text += fmt::format(", gain = {}", layer.gain);
  if (layer.init != Init::he) text += fmt::format(", initial = {}", name_of(layer.init));
  return text;
}

/// x = -y, y = x, channels = (-2, 1)
std::string orientation(const Layer& layer) {
  std::string text;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int from = layer.axes[axis];
    if (from == static_cast<int>(axis) + 1) continue;
    text += fmt::format(", {} = {}{}", axis_names[axis], from < 0 ? "-" : "", axis_names[std::abs(from) - 1]);
  }
  if (layer.order.empty()) return text;
  const bool is_one = layer.order.size() == 1;
  return text + fmt::format(", channels = {}{}{}", is_one ? "" : "(", fmt::join(layer.order, ", "), is_one ? "" : ")");
}

std::string print(const Layer& layer) {
  const std::string input = value_name(layer.input);
  switch (layer.kind) {
    case LayerKind::conv:
      return fmt::format("conv({}, {}, {}{})", input, layer.channels, layer.extent, conv_options(layer));
    case LayerKind::activate:
      if (layer.activation == Activation::leaky_relu) return fmt::format("leaky_relu({}, {})", input, layer.factor);
      return fmt::format("{}({})", name_of(layer.activation), input);
    case LayerKind::scale: return fmt::format("scale({}, {})", input, layer.factor);
    case LayerKind::add: return fmt::format("add({}, {})", input, value_name(layer.other));
    case LayerKind::concat: return fmt::format("concat({}, {})", input, value_name(layer.other));
    case LayerKind::mean_pool: return fmt::format("mean_pool({}, {})", input, layer.stride);
    case LayerKind::max_pool: return fmt::format("max_pool({}, {})", input, layer.stride);
    case LayerKind::upsample: return fmt::format("upsample({}, {})", input, layer.stride);
    case LayerKind::fix_sum: return fmt::format("fix_sum({}, {})", input, layer.factor);
    case LayerKind::reorient: return fmt::format("reorient({}{})", input, orientation(layer));
  }
  return "";
}

}  // namespace

std::string print(const Network& network) {
  std::string text = fmt::format("network {}({}) -> {} {{\n", network.name, network.inputs, network.outputs);
  for (int axis = 0; axis < network.rank(); ++axis) {
    text += fmt::format("{}{} {}", axis == 0 ? "  padding " : ", ", axis_names[axis],
                        name_of(network.padding[static_cast<std::size_t>(axis)]));
  }
  text += "\n";
  if (network.is_host()) return text + fmt::format("  host weights {}\n}}\n", network.host_weights);
  if (network.real == Precision::f64) text += "  real f64\n";
  if (network.seed != 0) text += fmt::format("  initial seed {}\n", network.seed);
  const int last = static_cast<int>(network.layers.size());
  for (int number = 1; number <= last; ++number) {
    text += fmt::format("  let v{} = {}\n", number, print(network.layers[static_cast<std::size_t>(number) - 1]));
  }
  return text + fmt::format("  out = {}\n}}\n", value_name(last));
}

}  // namespace dpde::network
