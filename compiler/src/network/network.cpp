// SPDX-License-Identifier: Apache-2.0
#include "network/network.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace dpde::network {
namespace {

std::int64_t kernel_weights(const Network& network, const Layer& layer) {
  if (layer.kind != LayerKind::conv) return 0;
  std::int64_t places = 1;
  for (int axis = 0; axis < network.rank(); ++axis) places *= layer.extent;
  return places * layer.channels * (channels_of(network, layer.input) / layer.groups);
}

/// Number of weights and biases; 0 if it shares those of another layer.
std::int64_t own_weights(const Network& network, const Layer& layer) {
  if (layer.kind != LayerKind::conv || layer.weights_of > 0) return 0;
  return kernel_weights(network, layer) + (layer.bias ? layer.channels : 0);
}

}  // namespace

int channels_of(const Network& network, int number) {
  return number == 0 ? network.inputs : network.layers[static_cast<std::size_t>(number) - 1].channels;
}

std::int64_t weights_begin(const Network& network, int index) {
  const Layer& layer = network.layers[static_cast<std::size_t>(index)];
  if (layer.weights_of > 0) return weights_begin(network, layer.weights_of - 1);
  if (layer.kind != LayerKind::conv) return -1;
  std::int64_t begin = 0;
  for (int i = 0; i < index; ++i) begin += own_weights(network, network.layers[static_cast<std::size_t>(i)]);
  return begin;
}

std::int64_t bias_begin(const Network& network, int index) {
  const Layer& layer = network.layers[static_cast<std::size_t>(index)];
  if (layer.kind != LayerKind::conv || !layer.bias) return -1;
  return weights_begin(network, index) + kernel_weights(network, layer);
}

std::int64_t weight_count(const Network& network) {
  std::int64_t count = network.is_host() ? network.host_weights : 0;
  for (const Layer& layer : network.layers) count += own_weights(network, layer);
  return count;
}

double multiplications_a_cell(const Network& network) {
  std::vector<double> sizes{1};  // width of the coarse cells of each value, in cells of the scene
  double total = 0;
  for (const Layer& layer : network.layers) {
    const double size = sizes[static_cast<std::size_t>(layer.input)];
    sizes.push_back(layer.kind == LayerKind::upsample ? size / layer.stride : size * layer.stride);
    total += static_cast<double>(kernel_weights(network, layer)) / std::pow(sizes.back(), network.rank());
  }
  return total;
}

bool is_pointwise(const Network& network) {
  return !network.is_host() && std::all_of(network.layers.begin(), network.layers.end(), [](const Layer& layer) {
    const bool changes_grid =
        layer.kind == LayerKind::mean_pool || layer.kind == LayerKind::max_pool || layer.kind == LayerKind::upsample;
    const bool moves_cells = layer.kind == LayerKind::reorient && layer.axes != std::array{1, 2, 3};
    return !changes_grid && !moves_cells && layer.extent == 1 && layer.stride == 1;
  });
}

std::vector<std::string> fields_read(const NetworkCall& network_call) {
  std::vector<std::string> fields = network_call.inputs;
  fields.insert(fields.end(), network_call.rates.begin(), network_call.rates.end());
  std::erase(fields, "");
  return fields;
}

std::vector<std::string> fields_written(const NetworkCall& network_call) {
  std::vector<std::string> fields = network_call.results;
  std::erase(fields, "");
  return fields;
}

std::size_t rate_count(const Network& network, NetworkCall::Mode mode) {
  const auto inputs = static_cast<std::size_t>(network.inputs), outputs = static_cast<std::size_t>(network.outputs);
  switch (mode) {
    case NetworkCall::Mode::value: return 0;
    case NetworkCall::Mode::tangent: return inputs;
    case NetworkCall::Mode::adjoint: return outputs;
    case NetworkCall::Mode::second: return inputs + outputs;
  }
  return 0;
}

std::size_t result_count(const Network& network, NetworkCall::Mode mode) {
  const auto inputs = static_cast<std::size_t>(network.inputs), outputs = static_cast<std::size_t>(network.outputs);
  switch (mode) {
    case NetworkCall::Mode::value:
    case NetworkCall::Mode::tangent: return outputs;
    case NetworkCall::Mode::adjoint: return inputs;
    case NetworkCall::Mode::second: return 2 * inputs;
  }
  return 0;
}

bool adds_to_weights(NetworkCall::Mode mode) {
  return mode == NetworkCall::Mode::adjoint || mode == NetworkCall::Mode::second;
}

namespace {

const char* word_of(NetworkCall::Mode mode) {
  switch (mode) {
    case NetworkCall::Mode::value: return "apply";
    case NetworkCall::Mode::tangent: return "tangent";
    case NetworkCall::Mode::adjoint: return "adjoint";
    case NetworkCall::Mode::second: return "second";
  }
  return "";
}

}  // namespace

std::string text_of(const NetworkCall& network_call) {
  const auto list = [](const std::vector<std::string>& fields) {
    std::vector<std::string> words;
    for (const std::string& field : fields) words.push_back(field.empty() ? "_" : field);
    return fmt::format("{}", fmt::join(words, ", "));
  };
  const bool is_value = network_call.mode == NetworkCall::Mode::value;
  const std::string rates = is_value ? "" : fmt::format(" by {}", list(network_call.rates));
  return fmt::format("{} {}({}){} to {}{}", word_of(network_call.mode), network_call.network, list(network_call.inputs),
                     rates, list(network_call.results), network_call.weights ? " weights" : "");
}

std::string_view name_of(Activation activation) {
  switch (activation) {
    case Activation::relu: return "relu";
    case Activation::leaky_relu: return "leaky_relu";
    case Activation::gelu: return "gelu";
    case Activation::tanh: return "tanh";
    case Activation::sigmoid: return "sigmoid";
    case Activation::softplus: return "softplus";
    case Activation::silu: return "silu";
  }
  return "";
}

std::string_view name_of(Padding padding) {
  switch (padding) {
    case Padding::periodic: return "periodic";
    case Padding::zero: return "zero";
    case Padding::replicate: return "replicate";
    case Padding::reflect: return "reflect";
  }
  return "";
}

std::string_view name_of(Init init) {
  switch (init) {
    case Init::he: return "he";
    case Init::xavier: return "xavier";
    case Init::zero: return "zero";
  }
  return "";
}

}  // namespace dpde::network
