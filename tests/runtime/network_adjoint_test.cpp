// SPDX-License-Identifier: Apache-2.0
// Adjoints of networks: against tangents (dot products) and differences (Taylor), for any number of threads, without
// allocations.
#include <gtest/gtest.h>

#include "allocations.h"
#include "dpde/runtime/error.h"
#include "network_run.h"

namespace dpde {
namespace {

using test::Case;
using test::Cells;
using test::TestNetwork;
using test::Values;
using Conv = TestNetwork::Conv;

void expect_transpose(const Case& c, const std::string& what) {
  Network run = c.make();
  const Values rates = c.tangent(run);
  const Case::Bars bars = c.adjoint(run);
  const double left = test::dot(rates, c.seeds),
               right = test::dot(c.rates, bars.inputs) + test::dot({c.weight_rates}, {bars.weights});
  double size = 1;
  for (size_t k = 0; k < rates.size(); ++k) {
    for (size_t i = 0; i < rates[k].size(); ++i) size += std::abs(rates[k][i] * c.seeds[k][i]);
  }
  EXPECT_LE(std::abs(left - right), 1e-12 * size) << what;
  EXPECT_EQ(c.adjoint(run).inputs, bars.inputs) << what << ", again";
  EXPECT_EQ(c.adjoint(run).weights, bars.weights) << what << ", again";
}

TEST(NetworkAdjoint, IsTheTransposeOfTheRates) {
  test::for_each_case([&](TestNetwork& network, const Cells& cells, const std::string& what) {
    expect_transpose(Case(network, cells), what);
  });
}

TEST(NetworkAdjoint, OnManyCells) {
  for (const test::Named& named : test::networks()) {
    for (const Cells& cells : {Cells{3001}, Cells{53, 41}, Cells{13, 11, 17}}) {
      TestNetwork network =
          named.make(static_cast<int>(cells.size()), {DPDE_PAD_REPLICATE, DPDE_PAD_PERIODIC, DPDE_PAD_REFLECT});
      expect_transpose(Case(network, cells), named.name);
    }
  }
}

/// Quarter turns, in memory whose rows and columns differ in length.
TEST(NetworkAdjoint, OfExchangedAxes) {
  for (const Cells& cells : {Cells{1, 1}, Cells{2, 2}, Cells{19, 19}, Cells{3, 3, 3}, Cells{6, 6, 6}}) {
    const bool three = cells.size() == 3;
    TestNetwork network(static_cast<int>(cells.size()), 3,
                        {DPDE_PAD_REPLICATE, DPDE_PAD_REPLICATE, DPDE_PAD_REPLICATE});
    const int a = network.conv({.channels = 3, .stride = 2}), b = network.reorient({-2, 1, 3}, {-2, 1, 3});
    network.join(DPDE_ADD, a, network.reorient(three ? std::array{2, -3, 1} : std::array{2, 1, 3}, {}, b));
    network.pool(DPDE_UPSAMPLE, 2);
    network.conv(Conv{2});
    const Case c(network, cells);
    expect_transpose(c, "exchanged axes");
    const test::Dense expected = c.expected();
    Network run = c.make(2);
    const Values found = c.value(run), rates = c.tangent(run);
    for (size_t k = 0; k < found.size(); ++k) {
      for (size_t i = 0; i < found[k].size(); ++i) {
        EXPECT_NEAR(found[k][i], expected.channels[k][i].v, 1e-13);
        EXPECT_NEAR(rates[k][i], expected.channels[k][i].d, 1e-12);
      }
    }
  }
}

TEST(NetworkAdjoint, ExchangedAxesHaveAsManyCells) {
  TestNetwork network(2, 2, {});
  network.reorient({2, 1, 3});
  const Case c(network, {3, 4});
  EXPECT_THROW(c.make(), Error);
}

/// Each weight and each input separately: dot products with random tangents could miss rare errors.
TEST(NetworkAdjoint, EachDerivativeByItself) {
  for (const auto& padding : test::paddings()) {
    TestNetwork network(2, 2, padding);
    network.conv({.channels = 3, .stride = 2});
    network.activate(DPDE_GELU);
    network.pool(DPDE_UPSAMPLE, 2);
    network.join(DPDE_CONCAT, network.last(), 0);
    network.conv(Conv{2, 5});
    Case c(network, {5, 4});
    Network run = c.make();
    const Case::Bars bars = c.adjoint(run);
    const auto check = [&](double& rate, double bar) {
      rate = 1;
      EXPECT_NEAR(test::dot(c.tangent(run), c.seeds), bar, 1e-12 * std::max(1.0, std::abs(bar)));
      rate = 0;
    };
    for (auto& channel : c.rates) std::fill(channel.begin(), channel.end(), 0.0);
    std::fill(c.weight_rates.begin(), c.weight_rates.end(), 0.0);
    for (size_t i = 0; i < c.weight_rates.size(); ++i) check(c.weight_rates[i], bars.weights[i]);
    for (size_t k = 0; k < c.rates.size(); ++k) {
      for (size_t i = 0; i < c.rates[k].size(); ++i) check(c.rates[k][i], bars.inputs[k][i]);
    }
  }
}

TEST(NetworkAdjoint, RestOfTaylorSeriesFallsQuadratically) {
  for (const int kind : {DPDE_GELU, DPDE_TANH, DPDE_SIGMOID, DPDE_SOFTPLUS, DPDE_SILU}) {
    TestNetwork network(2, 2, {DPDE_PAD_REPLICATE, DPDE_PAD_PERIODIC, 0});
    network.conv(Conv{5});
    network.activate(kind);
    network.conv(Conv{2, 5});
    Case c(network, {9, 7});
    Network run = c.make();
    const double base = test::dot(c.value(run), c.seeds);
    const Case::Bars bars = c.adjoint(run);
    const double slope = test::dot(c.rates, bars.inputs) + test::dot({c.weight_rates}, {bars.weights});
    const Values inputs = c.inputs;
    const std::vector<double> weights = c.weights;
    double rest[2];
    for (const int half : {0, 1}) {
      const double step = half ? 5e-4 : 1e-3;
      for (size_t k = 0; k < inputs.size(); ++k) {
        for (size_t i = 0; i < inputs[k].size(); ++i) c.inputs[k][i] = inputs[k][i] + step * c.rates[k][i];
      }
      for (size_t i = 0; i < weights.size(); ++i) c.weights[i] = weights[i] + step * c.weight_rates[i];
      run.set_weights(c.weights.data());
      rest[half] = std::abs(test::dot(c.value(run), c.seeds) - base - step * slope);
    }
    EXPECT_NEAR(std::log2(rest[0] / rest[1]), 2, 0.05) << kind;
  }
}

TEST(NetworkAdjoint, SinglePrecisionIsTheSameRounded) {
  test::for_each_case([&](TestNetwork& network, const Cells& cells, const std::string& what) {
    if (cells.size() != 2) return;  // the same code
    const Case full(network, cells);
    Network exact = full.make();
    network.set_real(DPDE_F32);
    const Case single(network, cells, DPDE_F32);
    Network run = single.make();
    if (what.find("pool") != std::string::npos) return;  // rounding may change which value is the largest
    const Case::Bars a = full.adjoint(exact), b = single.adjoint(run);
    double error = 0, size = 1;
    const auto compare = [&](double x, double y) {
      error = std::max(error, std::abs(x - y));
      size = std::max(size, std::abs(x));
    };
    for (size_t i = 0; i < a.weights.size(); ++i) compare(a.weights[i], b.weights[i]);
    for (size_t k = 0; k < a.inputs.size(); ++k) {
      for (size_t i = 0; i < a.inputs[k].size(); ++i) compare(a.inputs[k][i], b.inputs[k][i]);
    }
    EXPECT_LE(error, 1e-4 * size) << what;
  });
}

TEST(NetworkAdjoint, OfEqualValuesTheFirstIsTheLargest) {
  TestNetwork network(2, 1, {});
  network.pool(DPDE_MAX_POOL, 2);
  network.pool(DPDE_UPSAMPLE, 2);
  Case c(network, {5, 3});
  std::fill(c.inputs[0].begin(), c.inputs[0].end(), 0.5);
  c.inputs[0][6] = 0.75;  // x = 1, y = 1
  std::fill(c.seeds[0].begin(), c.seeds[0].end(), 1.0);
  Network run = c.make();
  EXPECT_EQ(c.adjoint(run).inputs[0], (std::vector<double>{0, 0, 4, 0, 2, 0, 4, 0, 0, 0, 2, 0, 2, 0, 1}));
}

TEST(NetworkAdjoint, NumberOfThreadsChangesNoBit) {
  for (const test::Named& named : test::networks()) {
    for (const Cells& cells : {Cells{2600}, Cells{20000}, Cells{65, 50}, Cells{17, 16, 9}}) {
      TestNetwork network =
          named.make(static_cast<int>(cells.size()), {DPDE_PAD_PERIODIC, DPDE_PAD_REFLECT, DPDE_PAD_ZERO});
      network.set_real(DPDE_F32);
      const Case c(network, cells);
      Network one = c.make(1), three = c.make(3);
      EXPECT_EQ(c.value(one), c.value(three)) << named.name;
      EXPECT_EQ(c.tangent(one), c.tangent(three)) << named.name;
      const Case::Bars a = c.adjoint(one), b = c.adjoint(three);
      EXPECT_EQ(a.inputs, b.inputs) << named.name;
      EXPECT_EQ(a.weights, b.weights) << named.name;
    }
  }
}

TEST(NetworkAdjoint, WhatWasNoNumberOnceLeavesNoTrace) {
  for (const test::Named& named : test::networks()) {
    for (const auto& padding : test::paddings()) {
      TestNetwork network = named.make(2, padding);
      const Case c(network, {19, 6});
      Case broken = c;
      for (auto* values : {&broken.inputs, &broken.rates, &broken.seeds}) {
        for (auto& channel : *values) std::fill(channel.begin(), channel.end(), std::nan(""));
      }
      Network fresh = c.make(), used = c.make();
      broken.adjoint(used);
      broken.tangent(used);
      EXPECT_EQ(c.value(fresh), c.value(used)) << named.name;
      const Case::Bars a = c.adjoint(fresh);
      EXPECT_EQ(c.tangent(fresh), c.tangent(used)) << named.name;
      const Case::Bars b = c.adjoint(used);
      EXPECT_EQ(a.inputs, b.inputs) << named.name;
      EXPECT_EQ(a.weights, b.weights) << named.name;
    }
  }
}

TEST(NetworkAdjoint, OnlyWhatIsWanted) {
  TestNetwork network(2, 3, {});
  network.conv(Conv{5});
  network.activate(DPDE_SILU);
  network.conv(Conv{2});
  const Case c(network, {18, 5});
  Network run = c.make();
  const Case::Bars bars = c.adjoint(run);
  const test::Fields in(c.layout, c.inputs), seeds(c.layout, c.seeds), out(c.layout, 3);
  std::vector<double> weights(bars.weights.size(), 1.5);
  run.adjoint(in.pointers(), seeds.pointers(), nullptr, weights.data());
  for (size_t i = 0; i < weights.size(); ++i) EXPECT_NEAR(weights[i], bars.weights[i] + 1.5, 1e-12);
  void* one[] = {nullptr, out.pointers()[1], nullptr};
  run.adjoint(in.pointers(), seeds.pointers(), one, nullptr);
  EXPECT_EQ(out.values()[1], bars.inputs[1]);
  EXPECT_TRUE(std::isnan(out.values()[0][0]));
  // A null seed and a null tangent mean 0.
  Case zero = c;
  std::fill(zero.seeds[0].begin(), zero.seeds[0].end(), 0.0);
  std::fill(zero.rates[2].begin(), zero.rates[2].end(), 0.0);
  void* second[] = {nullptr, seeds.pointers()[1]};
  std::fill(weights.begin(), weights.end(), 0.0);
  run.adjoint(in.pointers(), second, out.pointers(), weights.data());
  EXPECT_EQ(out.values(), zero.adjoint(run).inputs);
  EXPECT_EQ(weights, zero.adjoint(run).weights);
  const test::Fields rates(c.layout, c.rates), found(c.layout, 2);
  void* two[] = {rates.pointers()[0], rates.pointers()[1], nullptr};
  std::fill(zero.weight_rates.begin(), zero.weight_rates.end(), 0.0);
  run.tangent(in.pointers(), two, nullptr, found.pointers());
  EXPECT_EQ(found.values(), zero.tangent(run));
}

TEST(NetworkAdjoint, RunsAllocateNothing) {
  for (const int threads : {1, 2}) {
    for (const test::Named& named : test::networks()) {
      TestNetwork network = named.make(2, {DPDE_PAD_PERIODIC, DPDE_PAD_REPLICATE, 0});
      const Case c(network, {40, 31});
      const Team team(threads);
      team.run(2, [](std::int64_t, int) {});  // its threads start with the first task
      Network run = c.make(team);
      const test::Fields in(c.layout, c.inputs), rates(c.layout, c.rates), seeds(c.layout, c.seeds),
          out(c.layout, c.seeds.size()), bars(c.layout, c.inputs.size());
      std::vector<double> weight_bars(c.weights.size());
      const long before = test::allocations();
      run.set_weights(c.weights.data());
      run.value(in.pointers(), out.pointers());
      run.tangent(in.pointers(), rates.pointers(), c.weight_rates.data(), out.pointers());
      run.adjoint(in.pointers(), seeds.pointers(), bars.pointers(), weight_bars.data());
      EXPECT_EQ(test::allocations(), before) << named.name;
    }
  }
}

}  // namespace
}  // namespace dpde
