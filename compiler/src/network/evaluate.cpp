// SPDX-License-Identifier: Apache-2.0
// Every layer is a sum of terms factor * weight * value; for nonlinear layers the factor in the tangent depends on the
// values. So each layer has one list of terms, used for value, tangent and adjoint.
#include "network/evaluate.h"

#include <cmath>
#include <cstdlib>
#include <functional>

#include "support/assert.h"

namespace dpde::network {
namespace {

using Cell = std::array<int, 3>;

constexpr int none = -1;
/// Adds factor * weights[weight] * values[value].values[from] to result `to`; without a weight or a value, 1 replaces
/// it.
struct Term {
  std::size_t to;
  int value;
  std::ptrdiff_t from;
  std::int64_t weight;
  double factor;
};
using Visit = std::function<void(const Term&)>;

std::size_t size_of(const Cell& cells) {
  return static_cast<std::size_t>(cells[0]) * static_cast<std::size_t>(cells[1]) * static_cast<std::size_t>(cells[2]);
}
std::size_t index_of(const Tensor& tensor, int channel, const Cell& cell) {
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  return at(channel) * size_of(tensor.cells) + (at(cell[2]) * at(tensor.cells[1]) + at(cell[1])) * at(tensor.cells[0]) +
         at(cell[0]);
}
template <class F>
void for_each_cell(const Cell& cells, const F& f) {
  for (int z = 0; z < cells[2]; ++z) {
    for (int y = 0; y < cells[1]; ++y) {
      for (int x = 0; x < cells[0]; ++x) f(Cell{x, y, z});
    }
  }
}

/// The cell from which position p on an axis of n cells is read; `none` for zero padding.
int padded(int p, int n, Padding padding) {
  const auto wrapped = [](int i, int period) { return ((i % period) + period) % period; };
  switch (padding) {
    case Padding::periodic: return wrapped(p, n);
    case Padding::zero: return p < 0 || p >= n ? none : p;
    case Padding::replicate: return std::min(std::max(p, 0), n - 1);
    case Padding::reflect: {
      const int q = wrapped(p, 2 * n);
      return q < n ? q : 2 * n - 1 - q;
    }
  }
  unreachable("padding");
}

double activated(const Layer& layer, double v) {
  switch (layer.activation) {
    case Activation::relu: return v < 0 ? 0 : v;  // NaN stays NaN
    case Activation::leaky_relu: return v < 0 ? layer.factor * v : v;
    case Activation::gelu: return 0.5 * v * (1 + std::erf(v / std::sqrt(2.0)));
    case Activation::tanh: return std::tanh(v);
    case Activation::sigmoid: return 1 / (1 + std::exp(-v));
    case Activation::softplus: return v > 30 ? v : std::log1p(std::exp(v));
    case Activation::silu: return v / (1 + std::exp(-v));
  }
  unreachable("activation");
}

double slope(const Layer& layer, double v) {
  const double s = 1 / (1 + std::exp(-v));
  switch (layer.activation) {
    case Activation::relu: return v > 0 ? 1 : 0;
    case Activation::leaky_relu: return v > 0 ? 1 : layer.factor;
    case Activation::gelu:
      return 0.5 * (1 + std::erf(v / std::sqrt(2.0))) +
             v * std::exp(-v * v / 2) / std::sqrt(2 * 3.14159265358979323846);
    case Activation::tanh: return 1 - std::tanh(v) * std::tanh(v);
    case Activation::sigmoid: return s * (1 - s);
    case Activation::softplus: return s;
    case Activation::silu: return s * (1 + v * (1 - s));
  }
  unreachable("activation");
}

/// Second derivative of the activation; 0 for those with kinks.
double bend(const Layer& layer, double v) {
  const double s = 1 / (1 + std::exp(-v)), t = std::tanh(v);
  switch (layer.activation) {
    case Activation::relu:
    case Activation::leaky_relu: return 0;
    case Activation::gelu: return (2 - v * v) * std::exp(-v * v / 2) / std::sqrt(2 * 3.14159265358979323846);
    case Activation::tanh: return -2 * t * (1 - t * t);
    case Activation::sigmoid: return s * (1 - s) * (1 - 2 * s);
    case Activation::softplus: return s * (1 - s);
    case Activation::silu: return s * (1 - s) * (2 + v * (1 - 2 * s));
  }
  unreachable("activation");
}

/// A network on one grid: values of all layers, and the terms of each layer.
class Evaluation {
 public:
  Evaluation(const Network& network, const Tensor& inputs, const std::vector<double>& weights)
      : network_(network), weights_(weights) {
    require(inputs.channels == network.inputs, "one channel an input");
    values_.push_back(inputs);
    for (std::size_t i = 0; i < network.layers.size(); ++i) {
      Tensor result = shape_of(static_cast<int>(i));
      const Layer& layer = network.layers[i];
      if (layer.kind == LayerKind::activate) {
        for (std::size_t k = 0; k < result.values.size(); ++k)
          result.values[k] = activated(layer, input_of(layer).values[k]);
      } else {
        terms(static_cast<int>(i), result,
              [&](const Term& t) { result.values[t.to] += t.factor * weight(t, weights_) * value(t, values_); });
      }
      values_.push_back(std::move(result));
    }
  }

  const std::vector<Tensor>& values() const { return values_; }

  /// Tangents of all values.
  std::vector<Tensor> tangents(const Tensor& rates, const std::vector<double>& weight_rates) const {
    std::vector<Tensor> all{rates};
    for (std::size_t i = 0; i < network_.layers.size(); ++i) {
      Tensor result = values_[i + 1];
      result.values.assign(result.values.size(), 0.0);
      derivative_terms(static_cast<int>(i), [&](const Term& t) {
        if (t.from != none) result.values[t.to] += t.factor * weight(t, weights_) * value(t, all);
        if (t.weight != none && !weight_rates.empty())
          result.values[t.to] += t.factor * weight_rates[static_cast<std::size_t>(t.weight)] * value(t, values_);
      });
      all.push_back(std::move(result));
    }
    return all;
  }

  Tensor adjoint(const Tensor& seed, std::vector<double>& weight_bars) const {
    std::vector<Tensor> bars = values_;
    for (Tensor& bar : bars) bar.values.assign(bar.values.size(), 0.0);
    bars.back().values = seed.values;
    for (std::size_t i = network_.layers.size(); i-- > 0;) {
      const std::vector<double>& bar = bars[i + 1].values;
      derivative_terms(static_cast<int>(i), [&](const Term& t) {
        if (t.from != none)
          bars[static_cast<std::size_t>(t.value)].values[static_cast<std::size_t>(t.from)] +=
              t.factor * weight(t, weights_) * bar[t.to];
        if (t.weight != none)
          weight_bars[static_cast<std::size_t>(t.weight)] += t.factor * value(t, values_) * bar[t.to];
      });
    }
    return bars.front();
  }

  /// The adjoint in dual numbers x + e*x_dot with e*e = 0: the real part is the adjoint of the tangents, the e part
  /// that of the values.
  SecondBars second(const Tensor& input_rates, const Tensor& seed, const std::vector<double>& given_rates) const {
    const std::vector<Tensor> rates = tangents(input_rates, given_rates);
    std::vector<double> weight_rates = given_rates;
    weight_rates.resize(weights_.size());
    SecondBars result{{}, {}, std::vector<double>(weights_.size()), std::vector<double>(weights_.size())};
    std::vector<Tensor> bars = values_;
    for (Tensor& bar : bars) bar.values.assign(bar.values.size(), 0.0);
    std::vector<Tensor> rate_bars = bars;
    rate_bars.back().values = seed.values;
    for (std::size_t i = network_.layers.size(); i-- > 0;) {
      derivative_terms(static_cast<int>(i), [&](const Term& t) {
        const double bar = bars[i + 1].values[t.to], rate_bar = rate_bars[i + 1].values[t.to];
        const double w = weight(t, weights_), w_dot = t.weight == none ? 0 : weight(t, weight_rates);
        if (t.from != none) {
          const auto value = static_cast<std::size_t>(t.value), from = static_cast<std::size_t>(t.from);
          rate_bars[value].values[from] += t.factor * w * rate_bar;
          bars[value].values[from] += t.factor * (w * bar + w_dot * rate_bar) + factor_rate(i, t, rates) * rate_bar;
        }
        if (t.weight == none) return;
        const auto number = static_cast<std::size_t>(t.weight);
        result.weight_rates[number] += t.factor * value(t, values_) * rate_bar;
        const double v_dot = t.from == none ? 0 : value(t, rates);
        result.weights[number] += t.factor * (value(t, values_) * bar + v_dot * rate_bar);
      });
    }
    result.inputs = std::move(bars.front());
    result.input_rates = std::move(rate_bars.front());
    return result;
  }

 private:
  /// Tangent of a term's factor; only those of activations vary.
  double factor_rate(std::size_t index, const Term& t, const std::vector<Tensor>& rates) const {
    const Layer& layer = network_.layers[index];
    return layer.kind == LayerKind::activate ? bend(layer, value(t, values_)) * value(t, rates) : 0;
  }

  static double weight(const Term& t, const std::vector<double>& weights) {
    return t.weight == none ? 1.0 : weights[static_cast<std::size_t>(t.weight)];
  }
  static double value(const Term& t, const std::vector<Tensor>& values) {
    return t.from == none ? 1.0 : values[static_cast<std::size_t>(t.value)].values[static_cast<std::size_t>(t.from)];
  }
  const Tensor& input_of(const Layer& layer) const { return values_[static_cast<std::size_t>(layer.input)]; }

  /// Shape with ceil(cells / size) cells along each axis, where `size` is the coarsening of the value.
  Tensor shape_of(int index) {
    const Layer& layer = network_.layers[static_cast<std::size_t>(index)];
    int size = sizes_[static_cast<std::size_t>(layer.input)];
    if (layer.kind == LayerKind::upsample) {
      require(size % layer.stride == 0, "no grid is finer than that of the scene");
      size /= layer.stride;
    } else {
      size *= layer.stride;
    }
    sizes_.push_back(size);
    Tensor result{layer.channels, values_.front().cells, {}};
    for (int axis = 0; axis < network_.rank(); ++axis) {
      int& cells = result.cells[static_cast<std::size_t>(axis)];
      cells = (cells + size - 1) / size;
    }
    result.values.assign(static_cast<std::size_t>(result.channels) * size_of(result.cells), 0.0);
    return result;
  }

  /// Terms of the derivative at the values; for nonlinear layers with the slope as factor.
  void derivative_terms(int index, const Visit& visit) const {
    const Layer& layer = network_.layers[static_cast<std::size_t>(index)];
    const Tensor& result = values_[static_cast<std::size_t>(index) + 1];
    if (layer.kind != LayerKind::activate) return terms(index, result, visit);
    for (std::size_t k = 0; k < result.values.size(); ++k) {
      visit({k, layer.input, static_cast<std::ptrdiff_t>(k), none, slope(layer, input_of(layer).values[k])});
    }
  }

  void terms(int index, const Tensor& result, const Visit& visit) const {
    const Layer& layer = network_.layers[static_cast<std::size_t>(index)];
    switch (layer.kind) {
      case LayerKind::conv: return conv_terms(index, result, visit);
      case LayerKind::mean_pool:
      case LayerKind::max_pool: return pool_terms(layer, result, visit);
      case LayerKind::activate: unreachable("activations have no list of terms of their own");
      case LayerKind::scale:
      case LayerKind::add:
      case LayerKind::concat:
      case LayerKind::upsample:
      case LayerKind::fix_sum:
      case LayerKind::reorient: break;
    }
    for (int channel = 0; channel < layer.channels; ++channel) {
      for_each_cell(result.cells, [&](const Cell& cell) { cell_terms(layer, result, channel, cell, visit); });
    }
  }

  /// Terms of layers that read a single position of a finer or equal grid.
  void cell_terms(const Layer& layer, const Tensor& result, int channel, const Cell& cell, const Visit& visit) const {
    const std::size_t to = index_of(result, channel, cell);
    const auto from = [&](int value, int from_channel, const Cell& at) {
      return static_cast<std::ptrdiff_t>(index_of(values_[static_cast<std::size_t>(value)], from_channel, at));
    };
    if (layer.kind == LayerKind::scale)
      return visit({to, layer.input, from(layer.input, channel, cell), none, layer.factor});
    if (layer.kind == LayerKind::add) {
      visit({to, layer.input, from(layer.input, channel, cell), none, 1});
      return visit({to, layer.other, from(layer.other, channel, cell), none, 1});
    }
    if (layer.kind == LayerKind::concat) {
      const int first = input_of(layer).channels;
      const int value = channel < first ? layer.input : layer.other;
      return visit({to, value, from(value, channel < first ? channel : channel - first, cell), none, 1});
    }
    if (layer.kind == LayerKind::reorient) return reoriented_term(layer, to, channel, cell, visit);
    if (layer.kind == LayerKind::upsample) {
      Cell coarse = cell;
      for (int axis = 0; axis < network_.rank(); ++axis) coarse[static_cast<std::size_t>(axis)] /= layer.stride;
      return visit({to, layer.input, from(layer.input, channel, coarse), none, 1});
    }
    require(layer.kind == LayerKind::fix_sum, "a layer of known kind");
    visit({to, layer.input, from(layer.input, channel, cell), none, 1});
    visit({to, none, none, none, layer.factor / layer.channels});
    for (int other = 0; other < layer.channels; ++other)
      visit({to, layer.input, from(layer.input, other, cell), none, -1.0 / layer.channels});
  }

  void reoriented_term(const Layer& layer, std::size_t to, int channel, const Cell& cell, const Visit& visit) const {
    const Tensor& input = input_of(layer);
    Cell at = cell;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto from = static_cast<std::size_t>(std::abs(layer.axes[axis]) - 1);
      at[from] = layer.axes[axis] > 0 ? cell[axis] : input.cells[from] - 1 - cell[axis];
    }
    const int source = layer.order.empty() ? channel + 1 : layer.order[static_cast<std::size_t>(channel)];
    visit({to, layer.input, static_cast<std::ptrdiff_t>(index_of(input, std::abs(source) - 1, at)), none,
           source > 0 ? 1.0 : -1.0});
  }

  void conv_terms(int index, const Tensor& result, const Visit& visit) const {
    const Layer& layer = network_.layers[static_cast<std::size_t>(index)];
    const Tensor& input = input_of(layer);
    const std::int64_t first = weights_begin(network_, index), bias = bias_begin(network_, index);
    const int group_in = input.channels / layer.groups, group_out = layer.channels / layer.groups;
    Cell extents{1, 1, 1};
    for (int axis = 0; axis < network_.rank(); ++axis) extents[static_cast<std::size_t>(axis)] = layer.extent;
    const auto taps = static_cast<std::int64_t>(size_of(extents));
    for (int o = 0; o < layer.channels; ++o) {
      for_each_cell(result.cells, [&](const Cell& cell) {
        const std::size_t to = index_of(result, o, cell);
        if (bias != none) visit({to, none, none, bias + o, 1});
        std::int64_t tap = -1;
        for_each_cell(extents, [&](const Cell& k) {
          ++tap;
          Cell at = cell;
          for (std::size_t axis = 0; axis < static_cast<std::size_t>(network_.rank()); ++axis) {
            const int place = cell[axis] * layer.stride + layer.dilation * (k[axis] - layer.extent / 2);
            at[axis] = padded(place, input.cells[axis], network_.padding[axis]);
            if (at[axis] == none) return;
          }
          for (int i = 0; i < group_in; ++i) {
            const int channel = o / group_out * group_in + i;
            visit({to, layer.input, static_cast<std::ptrdiff_t>(index_of(input, channel, at)),
                   first + (static_cast<std::int64_t>(o) * group_in + i) * taps + tap, 1});
          }
        });
      });
    }
  }

  void pool_terms(const Layer& layer, const Tensor& result, const Visit& visit) const {
    const Tensor& input = input_of(layer);
    for (int channel = 0; channel < layer.channels; ++channel) {
      for_each_cell(result.cells, [&](const Cell& cell) {
        std::vector<std::size_t> places;
        Cell window{1, 1, 1};
        for (std::size_t axis = 0; axis < static_cast<std::size_t>(network_.rank()); ++axis) {
          window[axis] = std::min(layer.stride, input.cells[axis] - cell[axis] * layer.stride);
        }
        for_each_cell(window, [&](const Cell& in) {
          Cell at = cell;
          for (std::size_t axis = 0; axis < static_cast<std::size_t>(network_.rank()); ++axis)
            at[axis] = cell[axis] * layer.stride + in[axis];
          places.push_back(index_of(input, channel, at));
        });
        const std::size_t to = index_of(result, channel, cell);
        std::size_t best = places.front();
        for (const std::size_t place : places) {
          if (input.values[place] > input.values[best]) best = place;
          if (layer.kind == LayerKind::mean_pool)
            visit(
                {to, layer.input, static_cast<std::ptrdiff_t>(place), none, 1.0 / static_cast<double>(places.size())});
        }
        if (layer.kind == LayerKind::max_pool) visit({to, layer.input, static_cast<std::ptrdiff_t>(best), none, 1});
      });
    }
  }

  const Network& network_;
  const std::vector<double>& weights_;
  std::vector<Tensor> values_;
  std::vector<int> sizes_{1};  // coarsening of each value
};

}  // namespace

Tensor value(const Network& network, const Tensor& inputs, const std::vector<double>& weights) {
  return Evaluation(network, inputs, weights).values().back();
}

Tensor tangent(const Network& network, const Tensor& inputs, const Tensor& rates, const Weights& weights) {
  return Evaluation(network, inputs, weights.values).tangents(rates, weights.rates).back();
}

Tensor adjoint(const Network& network, const Tensor& inputs, const Tensor& seed, const std::vector<double>& weights,
               std::vector<double>& weight_bars) {
  return Evaluation(network, inputs, weights).adjoint(seed, weight_bars);
}

SecondBars second(const Network& network, const Tensor& inputs, const Tensor& rates, const Tensor& seed,
                  const Weights& weights) {
  return Evaluation(network, inputs, weights.values).second(rates, seed, weights.rates);
}

}  // namespace dpde::network
