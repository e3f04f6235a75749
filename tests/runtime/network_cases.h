// SPDX-License-Identifier: Apache-2.0
// Networks for tests, and their definition: plain loops over cells in doubles, or in pairs of a value and its tangent.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <numbers>
#include <string>
#include <vector>

#include "dpde/network_abi.h"
#include "dpde/runtime/layout.h"
#include "dpde/runtime/network.h"

namespace dpde::test {

using Cells = std::vector<int64_t>;

class TestNetwork {
 public:
  TestNetwork(int rank, int inputs, std::array<int32_t, 3> padding, int32_t real = DPDE_F64) {
    network_.name = "test";
    network_.rank = rank;
    network_.real = real;
    network_.inputs = network_.outputs = inputs;
    std::copy(padding.begin(), padding.end(), network_.padding);
    channels_.push_back(inputs);
  }

  struct Conv {
    int channels, extent = 3, stride = 1, dilation = 1, groups = 1;
    bool bias = true;
  };
  int conv(const Conv& conv, int input = -1) {
    dpde_layer layer = begin(DPDE_CONV, input);
    int64_t count = channels_[static_cast<size_t>(layer.input)] / conv.groups * conv.channels;
    for (int axis = 0; axis < network_.rank; ++axis) count *= conv.extent;
    layer.channels = conv.channels;
    layer.extent = conv.extent;
    layer.stride = conv.stride;
    layer.dilation = conv.dilation;
    layer.groups = conv.groups;
    layer.weights = network_.weight_count;
    layer.gain = 1;
    network_.weight_count += count;
    layer.bias = conv.bias ? network_.weight_count : -1;
    if (conv.bias) network_.weight_count += conv.channels;
    return add(layer);
  }
  int activate(int kind, double factor = 0.2, int input = -1) {
    dpde_layer layer = begin(DPDE_ACTIVATE, input);
    layer.activation = kind;
    layer.factor = factor;
    return add(layer);
  }
  int unary(int kind, double factor, int input = -1) {
    dpde_layer layer = begin(kind, input);
    layer.factor = factor;
    return add(layer);
  }
  int pool(int kind, int stride, int input = -1) {
    dpde_layer layer = begin(kind, input);
    layer.stride = stride;
    return add(layer);
  }
  int join(int kind, int a, int b) {
    dpde_layer layer = begin(kind, a);
    layer.other = b;
    if (kind == DPDE_CONCAT) layer.channels += channels_[static_cast<size_t>(b)];
    return add(layer);
  }
  int reorient(std::array<int32_t, 3> axes, std::vector<int32_t> order = {}, int input = -1) {
    dpde_layer layer = begin(DPDE_REORIENT, input);
    std::copy(axes.begin(), axes.end(), layer.axes);
    if (!order.empty()) layer.order = orders_.emplace_back(std::move(order)).data();
    return add(layer);
  }
  /// Shares the weights of another convolution.
  void share(int value, int with) {
    layers_[static_cast<size_t>(value) - 1].weights = layers_[static_cast<size_t>(with) - 1].weights;
    layers_[static_cast<size_t>(value) - 1].bias = layers_[static_cast<size_t>(with) - 1].bias;
  }
  int rank() const { return network_.rank; }
  int last() const { return static_cast<int>(layers_.size()); }

  const dpde_network& table() {
    network_.layers = layers_.data();
    network_.layer_count = static_cast<int32_t>(layers_.size());
    network_.outputs = channels_.back();
    return network_;
  }
  void set_real(int32_t real) { network_.real = real; }

 private:
  dpde_layer begin(int kind, int input) const {
    dpde_layer layer{};
    layer.kind = kind;
    layer.input = input < 0 ? last() : input;
    layer.channels = channels_[static_cast<size_t>(layer.input)];
    layer.bias = -1;
    return layer;
  }
  int add(const dpde_layer& layer) {
    layers_.push_back(layer);
    channels_.push_back(layer.channels);
    return last();
  }

  dpde_network network_{};
  std::vector<dpde_layer> layers_;
  std::deque<std::vector<int32_t>> orders_;
  std::vector<int> channels_;
};

/// A value and its tangent.
struct Dual {
  double v = 0, d = 0;
  Dual() = default;
  Dual(double value, double rate = 0) : v(value), d(rate) {}
};
inline Dual operator+(Dual a, Dual b) { return {a.v + b.v, a.d + b.d}; }
inline Dual operator*(Dual a, Dual b) { return {a.v * b.v, a.d * b.v + a.v * b.d}; }

/// f and f' of an activation, from the formulas of network_abi.h.
inline Dual activation(const dpde_layer& layer, Dual x) {
  const double e = std::exp(-x.v), s = 1 / (1 + e), v = x.v, a = layer.factor;
  switch (layer.activation) {
    case DPDE_RELU: return {std::max(v, 0.0), v > 0 ? x.d : 0};
    case DPDE_LEAKY_RELU: return {std::max(v, a * v), (v > a * v ? 1 : a) * x.d};
    case DPDE_GELU: {
      const double below = 0.5 * std::erfc(-v / std::numbers::sqrt2);
      return {v * below, (below + v * std::exp(-v * v / 2) / std::sqrt(2 * std::numbers::pi)) * x.d};
    }
    case DPDE_TANH: return {std::tanh(v), (1 - std::tanh(v) * std::tanh(v)) * x.d};
    case DPDE_SIGMOID: return {s, s * (1 - s) * x.d};
    case DPDE_SOFTPLUS: return {v > 30 ? v + std::log1p(e) : std::log1p(std::exp(v)), s * x.d};
    default: return {v * s, (s + v * s * (1 - s)) * x.d};
  }
}

/// Dense values, channel by channel, x fastest.
struct Dense {
  std::array<int64_t, 3> cells{1, 1, 1};
  std::vector<std::vector<Dual>> channels;

  Dense(std::array<int64_t, 3> of, size_t count)
      : cells(of), channels(count, std::vector<Dual>(static_cast<size_t>(of[0] * of[1] * of[2]))) {}
  size_t index(int64_t x, int64_t y, int64_t z) const { return static_cast<size_t>((z * cells[1] + y) * cells[0] + x); }
  template <class F>
  void for_each(const F& f) const {
    for (int64_t z = 0; z < cells[2]; ++z) {
      for (int64_t y = 0; y < cells[1]; ++y) {
        for (int64_t x = 0; x < cells[0]; ++x) f(std::array<int64_t, 3>{x, y, z});
      }
    }
  }
  size_t index(const std::array<int64_t, 3>& p) const { return index(p[0], p[1], p[2]); }
};

/// The cell that represents cell `k`, found step by step; -1: none.
inline int64_t place(int32_t padding, int64_t k, int64_t n) {
  if (padding == DPDE_PAD_PERIODIC) {
    while (k < 0) k += n;
    while (k >= n) k -= n;
    return k;
  }
  if (padding == DPDE_PAD_REPLICATE) return k < 0 ? 0 : k >= n ? n - 1 : k;
  if (padding == DPDE_PAD_ZERO) return k < 0 || k >= n ? -1 : k;
  while (k < 0 || k >= n) k = k < 0 ? -1 - k : 2 * n - 1 - k;
  return k;
}

inline Dense conv_by_definition(const dpde_network& network, const dpde_layer& layer, const Dense& in,
                                const std::vector<Dual>& weights, std::array<int64_t, 3> cells) {
  Dense result(cells, static_cast<size_t>(layer.channels));
  const int64_t e = layer.extent, ey = network.rank > 1 ? e : 1, ez = network.rank > 2 ? e : 1;
  const int64_t inputs = static_cast<int64_t>(in.channels.size()) / layer.groups,
                outputs = layer.channels / layer.groups;
  const auto source = [&](int axis, int64_t cell, int64_t k) {
    if (axis >= network.rank) return int64_t{0};
    return place(network.padding[axis], layer.stride * cell + layer.dilation * (k - e / 2),
                 in.cells[static_cast<size_t>(axis)]);
  };
  for (int64_t o = 0; o < layer.channels; ++o) {
    result.for_each([&](const std::array<int64_t, 3>& p) {
      Dual sum = layer.bias >= 0 ? weights[static_cast<size_t>(layer.bias + o)] : Dual{};
      for (int64_t i = 0; i < inputs; ++i) {
        for (int64_t kz = 0; kz < ez; ++kz) {
          for (int64_t ky = 0; ky < ey; ++ky) {
            for (int64_t kx = 0; kx < e; ++kx) {
              const int64_t x = source(0, p[0], kx), y = source(1, p[1], ky), z = source(2, p[2], kz);
              if (x < 0 || y < 0 || z < 0) continue;
              const auto w = static_cast<size_t>(layer.weights + (((o * inputs + i) * ez + kz) * ey + ky) * e + kx);
              sum = sum + weights[w] * in.channels[static_cast<size_t>(o / outputs * inputs + i)][in.index(x, y, z)];
            }
          }
        }
      }
      result.channels[static_cast<size_t>(o)][result.index(p)] = sum;
    });
  }
  return result;
}

inline Dense pool_by_definition(const dpde_layer& layer, const Dense& in, std::array<int64_t, 3> cells) {
  Dense result(cells, in.channels.size());
  for (size_t c = 0; c < in.channels.size(); ++c) {
    result.for_each([&](const std::array<int64_t, 3>& p) {
      Dual sum, most{-1e300};
      double count = 0;
      in.for_each([&](const std::array<int64_t, 3>& q) {
        for (size_t axis = 0; axis < 3; ++axis) {
          if (q[axis] / layer.stride != p[axis]) return;
        }
        const Dual value = in.channels[c][in.index(q)];
        sum = sum + value;
        count += 1;
        if (value.v > most.v) most = value;
      });
      result.channels[c][result.index(p)] = layer.kind == DPDE_MAX_POOL ? most : sum * Dual{1 / count};
    });
  }
  return result;
}

inline Dense layer_by_definition(const dpde_layer& layer, const Dense& in, const Dense& other,
                                 std::array<int64_t, 3> cells) {
  Dense result(cells, static_cast<size_t>(layer.channels));
  for (size_t c = 0; c < result.channels.size(); ++c) {
    result.for_each([&](const std::array<int64_t, 3>& p) {
      Dual& to = result.channels[c][result.index(p)];
      if (layer.kind == DPDE_CONCAT && c >= in.channels.size()) {
        to = other.channels[c - in.channels.size()][result.index(p)];
        return;
      }
      if (layer.kind == DPDE_UPSAMPLE) {
        to = in.channels[c][in.index(p[0] / layer.stride, p[1] / layer.stride, p[2] / layer.stride)];
        return;
      }
      if (layer.kind == DPDE_REORIENT) {
        std::array<int64_t, 3> q{};
        for (size_t axis = 0; axis < 3; ++axis) {
          const auto along = static_cast<size_t>(std::abs(layer.axes[axis])) - 1;
          q[along] = layer.axes[axis] > 0 ? p[axis] : in.cells[along] - 1 - p[axis];
        }
        const int from = layer.order ? layer.order[c] : static_cast<int>(c) + 1;
        to = in.channels[static_cast<size_t>(std::abs(from)) - 1][in.index(q[0], q[1], q[2])] *
             Dual{from > 0 ? 1.0 : -1.0};
        return;
      }
      const Dual from = in.channels[c][result.index(p)];
      to = from;
      if (layer.kind == DPDE_ACTIVATE) to = activation(layer, from);
      if (layer.kind == DPDE_SCALE) to = from * Dual{layer.factor};
      if (layer.kind == DPDE_ADD) to = from + other.channels[c][result.index(p)];
      if (layer.kind == DPDE_FIX_SUM) {
        Dual sum;
        for (const auto& channel : in.channels) sum = sum + channel[result.index(p)];
        const auto n = static_cast<double>(layer.channels);
        to = from + Dual{(layer.factor - sum.v) / n, -sum.d / n};
      }
    });
  }
  return result;
}

inline Dense by_definition(const dpde_network& network, const Dense& input, const std::vector<Dual>& weights) {
  std::vector<Dense> values{input};
  std::vector<int64_t> levels{1};
  for (int32_t k = 0; k < network.layer_count; ++k) {
    const dpde_layer& layer = network.layers[k];
    const Dense &in = values[static_cast<size_t>(layer.input)], &other = values[static_cast<size_t>(layer.other)];
    int64_t level = levels[static_cast<size_t>(layer.input)];
    if (layer.kind == DPDE_CONV || layer.kind == DPDE_MEAN_POOL || layer.kind == DPDE_MAX_POOL) level *= layer.stride;
    if (layer.kind == DPDE_UPSAMPLE) level /= layer.stride;
    std::array<int64_t, 3> cells{1, 1, 1};
    for (int axis = 0; axis < network.rank; ++axis) {
      const auto a = static_cast<size_t>(axis);
      while (cells[a] * level < input.cells[a]) ++cells[a];
    }
    levels.push_back(level);
    if (layer.kind == DPDE_CONV) {
      values.push_back(conv_by_definition(network, layer, in, weights, cells));
    } else if (layer.kind == DPDE_MEAN_POOL || layer.kind == DPDE_MAX_POOL) {
      values.push_back(pool_by_definition(layer, in, cells));
    } else {
      values.push_back(layer_by_definition(layer, in, other, cells));
    }
  }
  return values.back();
}

}  // namespace dpde::test
