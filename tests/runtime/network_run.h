// SPDX-License-Identifier: Apache-2.0
// Runs a TestNetwork on fields and by its definition, with random numbers.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "dpde/runtime/field.h"
#include "network_cases.h"

namespace dpde::test {

using Values = std::vector<std::vector<double>>;  // dense, of each channel

inline std::vector<double> random_values(size_t count, uint32_t seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> values(count);
  for (double& value : values) value = uniform(engine);
  return values;
}

inline double dot(const Values& a, const Values& b) {
  double sum = 0;
  for (size_t c = 0; c < a.size(); ++c) {
    for (size_t i = 0; i < a[c].size(); ++i) sum += a[c][i] * b[c][i];
  }
  return sum;
}

/// Fields with NaN in ghost cells and padding, to detect reads.
class Fields {
 public:
  Fields(const dpde_layout& layout, size_t count) {
    for (size_t c = 0; c < count; ++c) {
      fields_.emplace_back(layout, static_cast<int>(c));
      fields_.back().fill(std::nan(""));
      pointers_.push_back(fields_.back().base());
    }
  }
  Fields(const dpde_layout& layout, const Values& values) : Fields(layout, values.size()) {
    for (size_t c = 0; c < values.size(); ++c) fields_[c].copy_in(values[c]);
  }
  void* const* pointers() const { return pointers_.data(); }
  Values values() const {
    Values result;
    for (const Field& field : fields_) {
      result.emplace_back(static_cast<size_t>(cell_count(field.layout())));
      field.copy_out(result.back());
    }
    return result;
  }

 private:
  std::vector<Field> fields_;
  std::vector<void*> pointers_;
};

/// A network with random weights and inputs on a grid.
struct Case {
  dpde_network network;
  dpde_layout layout;
  std::vector<double> weights, weight_rates;
  Values inputs, rates, seeds;

  Case(TestNetwork& test, Cells cells, int32_t field_real = DPDE_F64) : network(test.table()) {
    layout = make_layout(cells, {2, cells.size() > 1 ? 1 : 0, 0}, field_real);
    const auto count = static_cast<size_t>(cell_count(layout)), n = static_cast<size_t>(network.weight_count);
    weights = random_values(n, 1);
    weight_rates = random_values(n, 2);
    for (uint32_t c = 0; c < static_cast<uint32_t>(network.inputs); ++c) {
      inputs.push_back(random_values(count, 10 + c));
      rates.push_back(random_values(count, 100 + c));
    }
    for (uint32_t c = 0; c < static_cast<uint32_t>(network.outputs); ++c)
      seeds.push_back(random_values(count, 1000 + c));
  }

  Dense expected() const {
    Dense dense({layout.cells[0], layout.cells[1], layout.cells[2]}, inputs.size());
    for (size_t c = 0; c < inputs.size(); ++c) {
      for (size_t i = 0; i < inputs[c].size(); ++i) dense.channels[c][i] = {inputs[c][i], rates[c][i]};
    }
    std::vector<Dual> all;
    for (size_t i = 0; i < weights.size(); ++i) all.emplace_back(weights[i], weight_rates[i]);
    return by_definition(network, dense, all);
  }
  Network make(const Team& team = 1) const {
    Network result(network, layout, team);
    result.set_weights(weights.data());
    return result;
  }
  Values value(Network& run) const {
    const Fields in(layout, inputs), out(layout, seeds.size());
    run.value(in.pointers(), out.pointers());
    return out.values();
  }
  Values tangent(Network& run) const {
    const Fields in(layout, inputs), in_rates(layout, rates), out(layout, seeds.size());
    run.tangent(in.pointers(), in_rates.pointers(), weight_rates.data(), out.pointers());
    return out.values();
  }
  struct Bars {
    Values inputs;
    std::vector<double> weights;
  };
  Bars adjoint(Network& run) const {
    const Fields in(layout, inputs), out(layout, seeds), bars(layout, inputs.size());
    Bars result{{}, std::vector<double>(weights.size(), 0.0)};
    run.adjoint(in.pointers(), out.pointers(), bars.pointers(), result.weights.data());
    result.inputs = bars.values();
    return result;
  }
};

struct Named {
  std::string name;
  std::function<TestNetwork(int rank, std::array<int32_t, 3> padding)> make;
};

/// One network for each kind of layer and for combinations.
inline std::vector<Named> networks() {
  using Conv = TestNetwork::Conv;
  std::vector<Named> result;
  const auto add = [&](const std::string& name, int inputs, const std::function<void(TestNetwork&)>& layers) {
    result.push_back({name, [=](int rank, std::array<int32_t, 3> padding) {
                        TestNetwork network(rank, inputs, padding);
                        layers(network);
                        return network;
                      }});
  };
  add("conv3", 2, [](TestNetwork& n) { n.conv(Conv{3}); });
  add("conv5 to 13", 3, [](TestNetwork& n) { n.conv(Conv{13, 5}); });
  add("dense", 3, [](TestNetwork& n) { n.conv(Conv{11, 1}); });
  add("no bias", 1, [](TestNetwork& n) { n.conv({.channels = 1, .bias = false}); });
  add("dilation", 2, [](TestNetwork& n) { n.conv({.channels = 9, .dilation = 3}); });
  add("groups", 6, [](TestNetwork& n) { n.conv({.channels = 9, .groups = 3}); });
  add("depthwise", 5, [](TestNetwork& n) { n.conv({.channels = 5, .groups = 5}); });
  add("wide", 16, [](TestNetwork& n) { n.conv(Conv{16}); });
  add("stride 2", 2, [](TestNetwork& n) {
    n.conv({.channels = 3, .stride = 2});
    n.pool(DPDE_UPSAMPLE, 2);
  });
  add("stride 3, extent 5, dilation 2, groups", 4, [](TestNetwork& n) {
    n.conv({.channels = 6, .extent = 5, .stride = 3, .dilation = 2, .groups = 2});
    n.pool(DPDE_UPSAMPLE, 3);
  });
  add("dense with stride 2", 2, [](TestNetwork& n) {
    n.conv({.channels = 3, .extent = 1, .stride = 2});
    n.pool(DPDE_UPSAMPLE, 2);
  });
  for (int kind = DPDE_RELU; kind <= DPDE_SILU; ++kind) {
    add("activation " + std::to_string(kind), 3, [kind](TestNetwork& n) {
      n.activate(kind);
      n.conv(Conv{4});
      n.activate(kind);
      n.conv(Conv{3});
    });
  }
  add("leaky relu of other factors", 2, [](TestNetwork& n) {
    n.conv(Conv{3});
    n.activate(DPDE_LEAKY_RELU, -0.5);
    n.conv(Conv{2});
    n.activate(DPDE_LEAKY_RELU, 1.5);
  });
  add("scale, fixed sum", 3, [](TestNetwork& n) {
    n.unary(DPDE_SCALE, 0.3);
    n.conv(Conv{3});
    n.unary(DPDE_SCALE, -2);
    n.unary(DPDE_FIX_SUM, 1);
    n.conv(Conv{2});
  });
  add("pools", 2, [](TestNetwork& n) {
    const int mean = n.pool(DPDE_MEAN_POOL, 2), most = n.pool(DPDE_MAX_POOL, 2, 0);
    n.join(DPDE_CONCAT, mean, most);
    n.pool(DPDE_UPSAMPLE, 2);
  });
  add("residual", 4, [](TestNetwork& n) {
    for (int k = 0; k < 2; ++k) {
      const int before = n.last();
      n.conv(Conv{4});
      n.activate(DPDE_RELU);
      n.conv(Conv{4});
      n.join(DPDE_ADD, before, n.last());
      n.activate(DPDE_RELU);
    }
    n.conv(Conv{1, 5});
  });
  add("sums that convolutions could begin with", 3, [](TestNetwork& n) {
    const int a = n.conv(Conv{3});
    n.activate(DPDE_GELU);
    const int b = n.conv(Conv{3, 5});
    n.join(DPDE_ADD, b, a);
    const int c = n.activate(DPDE_GELU), d = n.conv(Conv{3}, a), e = n.join(DPDE_ADD, c, d);
    n.activate(DPDE_TANH);
    n.join(DPDE_ADD, n.conv(Conv{3}), e);
    const int f = n.conv({.channels = 3, .stride = 2}), g = n.conv({.channels = 3, .stride = 2}, a);
    n.join(DPDE_ADD, g, f);
    n.pool(DPDE_UPSAMPLE, 2);
    n.join(DPDE_ADD, n.last(), n.conv(Conv{3}, 0));
    n.join(DPDE_ADD, n.conv(Conv{3}, 0), n.last());
  });
  add("U-net", 2, [](TestNetwork& n) {
    const int a = n.conv(Conv{5});
    n.activate(DPDE_GELU);
    n.pool(DPDE_MEAN_POOL, 2);
    const int b = n.conv(Conv{6});
    n.conv({.channels = 7, .stride = 2});
    n.activate(DPDE_SILU);
    n.pool(DPDE_UPSAMPLE, 2);
    n.join(DPDE_CONCAT, b, n.last());
    n.pool(DPDE_UPSAMPLE, 2);
    n.join(DPDE_CONCAT, n.last(), a);
    n.conv(Conv{2, 1});
  });
  add("values with many readers", 3, [](TestNetwork& n) {
    const int a = n.conv(Conv{3}), b = n.activate(DPDE_TANH), c = n.activate(DPDE_SOFTPLUS, 0, a),
              d = n.conv(Conv{3, 5}, b);
    n.conv(Conv{8}, a);  // not read
    n.join(DPDE_ADD, c, d);
    n.join(DPDE_ADD, n.last(), n.last());
    n.join(DPDE_ADD, n.last(), 0);
    n.join(DPDE_CONCAT, n.last(), b);
  });
  add("per cell", 3, [](TestNetwork& n) {
    n.conv(Conv{9, 1});
    n.activate(DPDE_GELU);
    const int a = n.conv(Conv{9, 1});
    n.activate(DPDE_RELU);
    n.join(DPDE_CONCAT, a, n.last());
    n.conv(Conv{2, 1});
  });
  add("mirror images with shared weights", 3, [](TestNetwork& n) {
    const auto mirror = [&](int input) {
      std::array<int32_t, 3> axes{-1, 2, 3};
      if (n.rank() > 2) axes[2] = -3;
      return n.reorient(axes, {-1, 3, 2}, input);
    };
    const int a = n.conv({.channels = 3, .stride = 2}, 0), image = mirror(a), copy = n.conv(Conv{3}, image),
              other = n.conv(Conv{3}, a);
    n.share(other, copy);
    n.activate(DPDE_TANH);
    mirror(n.last());
    n.join(DPDE_ADD, n.last(), image);
    n.join(DPDE_CONCAT, n.last(), mirror(copy));
    n.pool(DPDE_UPSAMPLE, 2);
    n.reorient({1, n.rank() > 1 ? -2 : 2, 3});
    n.conv(Conv{2});
  });
  add("per cell with exchanged channels", 3, [](TestNetwork& n) {
    const int a = n.conv(Conv{3, 1}), b = n.reorient({1, 2, 3}, {2, -1, 3}, 0), c = n.conv(Conv{3, 1}, b);
    n.share(c, a);
    n.activate(DPDE_GELU);
    n.join(DPDE_ADD, a, n.last());
  });
  add("nothing", 2, [](TestNetwork&) {});
  return result;
}

/// Grids of all ranks: smaller than kernels, smaller than vectors, and larger.
inline std::vector<Cells> grids() {
  return {{1}, {2}, {3}, {19}, {67}, {1, 1}, {2, 3}, {3, 1}, {17, 6}, {35, 9}, {1, 2, 3}, {5, 4, 3}, {18, 3, 5}};
}

inline std::vector<std::array<int32_t, 3>> paddings() {
  constexpr int32_t p = DPDE_PAD_PERIODIC, z = DPDE_PAD_ZERO, r = DPDE_PAD_REPLICATE, m = DPDE_PAD_REFLECT;
  return {{p, p, p}, {z, z, z}, {r, r, r}, {m, m, m}, {p, r, z}, {m, p, r}};
}

/// Calls `f(network, cells, description)` for all combinations.
template <class F>
void for_each_case(const F& f) {
  for (const Named& named : networks()) {
    for (const Cells& cells : grids()) {
      for (const auto& padding : paddings()) {
        TestNetwork network = named.make(static_cast<int>(cells.size()), padding);
        std::string what = named.name + " on";
        for (const int64_t n : cells) what += " " + std::to_string(n);
        f(network, cells,
          what + ", paddings " + std::to_string(padding[0]) + std::to_string(padding[1]) + std::to_string(padding[2]));
      }
    }
  }
}

}  // namespace dpde::test
