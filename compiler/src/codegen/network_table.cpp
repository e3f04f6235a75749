// SPDX-License-Identifier: Apache-2.0
#include "codegen/network_table.h"

#include "dpde/kernel_abi.h"
#include "support/assert.h"

namespace dpde::codegen {
namespace {

using network::Activation;
using network::Init;
using network::LayerKind;
using network::Padding;

int32_t kind_of(LayerKind kind) {
  switch (kind) {
    case LayerKind::conv: return DPDE_CONV;
    case LayerKind::activate: return DPDE_ACTIVATE;
    case LayerKind::scale: return DPDE_SCALE;
    case LayerKind::add: return DPDE_ADD;
    case LayerKind::concat: return DPDE_CONCAT;
    case LayerKind::mean_pool: return DPDE_MEAN_POOL;
    case LayerKind::max_pool: return DPDE_MAX_POOL;
    case LayerKind::upsample: return DPDE_UPSAMPLE;
    case LayerKind::fix_sum: return DPDE_FIX_SUM;
    case LayerKind::reorient: return DPDE_REORIENT;
  }
  unreachable("kind of layer");
}

int32_t kind_of(Activation activation) {
  switch (activation) {
    case Activation::relu: return DPDE_RELU;
    case Activation::leaky_relu: return DPDE_LEAKY_RELU;
    case Activation::gelu: return DPDE_GELU;
    case Activation::tanh: return DPDE_TANH;
    case Activation::sigmoid: return DPDE_SIGMOID;
    case Activation::softplus: return DPDE_SOFTPLUS;
    case Activation::silu: return DPDE_SILU;
  }
  unreachable("activation");
}

int32_t kind_of(Padding padding) {
  switch (padding) {
    case Padding::periodic: return DPDE_PAD_PERIODIC;
    case Padding::zero: return DPDE_PAD_ZERO;
    case Padding::replicate: return DPDE_PAD_REPLICATE;
    case Padding::reflect: return DPDE_PAD_REFLECT;
  }
  unreachable("padding");
}

int32_t kind_of(Init init) {
  switch (init) {
    case Init::he: return DPDE_INIT_HE;
    case Init::xavier: return DPDE_INIT_XAVIER;
    case Init::zero: return DPDE_INIT_ZERO;
  }
  unreachable("initial weights");
}

}  // namespace

NetworkTable::NetworkTable(const network::Network& network) : name_(network.name) {
  for (std::size_t i = 0; i < network.layers.size(); ++i) {
    const network::Layer& l = network.layers[i];
    const int index = static_cast<int>(i);
    orders_.emplace_back(l.order.begin(), l.order.end());
    layers_.push_back({kind_of(l.kind),
                       l.input,
                       l.other,
                       l.channels,
                       l.extent,
                       l.stride,
                       l.dilation,
                       l.groups,
                       kind_of(l.activation),
                       l.factor,
                       weights_begin(network, index),
                       bias_begin(network, index),
                       kind_of(l.init),
                       l.gain,
                       {l.axes[0], l.axes[1], l.axes[2]},
                       l.order.empty() ? nullptr : orders_.back().data()});
  }
  table_.name = name_.c_str();
  table_.rank = network.rank();
  table_.real = network.real == Precision::f32 ? DPDE_F32 : DPDE_F64;
  table_.inputs = network.inputs;
  table_.outputs = network.outputs;
  for (std::size_t axis = 0; axis < network.padding.size(); ++axis)
    table_.padding[axis] = kind_of(network.padding[axis]);
  table_.weight_count = weight_count(network);
  table_.seed = network.seed;
  table_.layer_count = static_cast<int32_t>(layers_.size());
  table_.layers = layers_.data();
  table_.is_host = network.is_host() ? 1 : 0;
}

}  // namespace dpde::codegen
