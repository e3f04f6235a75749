// SPDX-License-Identifier: Apache-2.0
// Words for network layers, with their arguments and an example for messages.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "network/network.h"

namespace dpde::model {

struct LayerWord {
  std::string_view name;
  network::LayerKind kind;
  network::Activation activation = network::Activation::relu;
  const char* example;
};
constexpr LayerWord layer_words[] = {
    {"conv", network::LayerKind::conv, {}, "conv 32, 5"},
    {"dense", network::LayerKind::conv, {}, "dense 32"},
    {"relu", network::LayerKind::activate, network::Activation::relu, "relu"},
    {"leaky_relu", network::LayerKind::activate, network::Activation::leaky_relu, "leaky_relu(0.2)"},
    {"gelu", network::LayerKind::activate, network::Activation::gelu, "gelu"},
    {"tanh", network::LayerKind::activate, network::Activation::tanh, "tanh"},
    {"sigmoid", network::LayerKind::activate, network::Activation::sigmoid, "sigmoid"},
    {"softplus", network::LayerKind::activate, network::Activation::softplus, "softplus"},
    {"silu", network::LayerKind::activate, network::Activation::silu, "silu"},
    {"scale", network::LayerKind::scale, {}, "scale 0.01"},
    {"mean_pool", network::LayerKind::mean_pool, {}, "mean_pool 2"},
    {"max_pool", network::LayerKind::max_pool, {}, "max_pool 2"},
    {"upsample", network::LayerKind::upsample, {}, "upsample 2"},
    {"fix_sum", network::LayerKind::fix_sum, {}, "fix_sum 1"},
    {"add", network::LayerKind::add, {}, "let c = add(a, b)"},
    {"concat", network::LayerKind::concat, {}, "let c = concat(a, b)"},
    {"reorient", network::LayerKind::reorient, {}, "reorient x = -x, channels = (-1, 2)"},
};
constexpr const char* conv_options[] = {"stride", "dilation", "groups", "bias", "gain", "initial", "weights"};
constexpr const char* reorient_options[] = {"x", "y", "z", "channels"};

inline bool joins(network::LayerKind kind) {
  return kind == network::LayerKind::add || kind == network::LayerKind::concat;
}
inline bool is_dense(const LayerWord& word) { return word.name == "dense"; }
inline std::vector<std::string> options_of(const LayerWord& word) {
  if (word.kind == network::LayerKind::reorient) return {std::begin(reorient_options), std::end(reorient_options)};
  if (word.kind != network::LayerKind::conv) return {};
  std::vector<std::string> options(std::begin(conv_options), std::end(conv_options));
  if (is_dense(word))
    std::erase_if(options, [](const std::string& option) { return option == "stride" || option == "dilation"; });
  return options;
}

/// Minimum and maximum number of unnamed arguments of a layer, without its input values.
inline std::pair<std::size_t, std::size_t> least_and_most_arguments(const LayerWord& word) {
  if (word.kind == network::LayerKind::conv) return is_dense(word) ? std::pair(1, 1) : std::pair(2, 2);
  if (word.kind == network::LayerKind::activate) return {0, word.activation == network::Activation::leaky_relu ? 1 : 0};
  return joins(word.kind) || word.kind == network::LayerKind::reorient ? std::pair(0, 0) : std::pair(1, 1);
}

}  // namespace dpde::model
