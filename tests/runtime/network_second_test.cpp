// SPDX-License-Identifier: Apache-2.0
// Second derivatives of networks: adjoints of the tangents against differences of adjoints, in single precision, for
// any number of threads, without allocations.
#include <gtest/gtest.h>

#include "allocations.h"
#include "network_run.h"
#include "support/setting.h"

namespace dpde {
namespace {

using test::Case;
using test::Cells;
using test::TestNetwork;
using test::Values;

struct Bars {
  Values inputs, input_rates;
  std::vector<double> weights, weight_rates;
};

Bars second(const Case& c, Network& run) {
  const test::Fields in(c.layout, c.inputs), rates(c.layout, c.rates), seeds(c.layout, c.seeds),
      bars(c.layout, c.inputs.size()), rate_bars(c.layout, c.inputs.size());
  Bars result{{}, {}, std::vector<double>(c.weights.size()), std::vector<double>(c.weights.size())};
  run.second({in.pointers(), rates.pointers(), seeds.pointers(), bars.pointers(), rate_bars.pointers(),
              c.weight_rates.data(), result.weights.data(), result.weight_rates.data()});
  result.inputs = bars.values();
  result.input_rates = rate_bars.values();
  return result;
}

Network make(const Case& c, const Team& team = 1) {
  Network result(c.network, c.layout, team, true);
  result.set_weights(c.weights.data());
  return result;
}

/// All numbers in one vector.
std::vector<double> joined(const Values& inputs, const std::vector<double>& weights) {
  std::vector<double> all = weights;
  for (const std::vector<double>& channel : inputs) all.insert(all.end(), channel.begin(), channel.end());
  return all;
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double error = 0, size = 1;
  for (size_t i = 0; i < a.size(); ++i) {
    error = std::max(error, std::abs(a[i] - b[i]));
    size = std::max(size, std::abs(b[i]));
  }
  return error / size;
}

/// The difference quotient of the adjoint along the tangents.
std::vector<double> quotient(const Case& c, double step) {
  std::vector<double> result;
  for (const double by : {step, -step}) {
    Case moved = c;
    for (size_t k = 0; k < c.inputs.size(); ++k) {
      for (size_t i = 0; i < c.inputs[k].size(); ++i) moved.inputs[k][i] += by * c.rates[k][i];
    }
    for (size_t i = 0; i < c.weights.size(); ++i) moved.weights[i] += by * c.weight_rates[i];
    Network run = moved.make();
    const Case::Bars bars = moved.adjoint(run);
    const std::vector<double> all = joined(bars.inputs, bars.weights);
    result.resize(all.size());
    for (size_t i = 0; i < all.size(); ++i) result[i] += all[i] / (2 * by);
  }
  return result;
}

/// Larger steps may cross a kink; for the smallest one rounding is 1e-8.
void expect_rate_of_adjoint(const Case& c, const std::string& what) {
  Network run = make(c);
  const Bars bars = second(c, run);
  const Case::Bars first = c.adjoint(run);
  EXPECT_LE(distance(joined(bars.input_rates, bars.weight_rates), joined(first.inputs, first.weights)), 1e-13) << what;
  const std::vector<double> found = joined(bars.inputs, bars.weights);
  double error = 1;
  for (const double step : {1e-5, 1e-6, 1e-7}) {
    error = std::min(error, distance(found, quotient(c, step)));
    if (error <= 1e-7) break;
  }
  EXPECT_LE(error, 1e-7) << what;
  EXPECT_EQ(second(c, run).weights, bars.weights) << what << ", again";
  EXPECT_EQ(c.adjoint(run).weights, first.weights) << what << ", first derivatives again";
}

TEST(NetworkSecond, IsHowTheAdjointChanges) {
  std::size_t number = 0;
  test::for_each_case([&](TestNetwork& network, const Cells& cells, const std::string& what) {
    if (testing::is_tried(number++, 5)) expect_rate_of_adjoint(Case(network, cells), what);
  });
}

TEST(NetworkSecond, OnManyCells) {
  for (const test::Named& named : test::networks()) {
    TestNetwork network = named.make(1, {DPDE_PAD_REPLICATE, 0, 0});
    expect_rate_of_adjoint(Case(network, {3001}), named.name);
  }
}

TEST(NetworkSecond, SinglePrecisionIsTheSameRounded) {
  for (const test::Named& named : test::networks()) {
    if (named.name.find("pool") != std::string::npos) continue;  // rounding may change which value is the largest
    TestNetwork network = named.make(2, {DPDE_PAD_PERIODIC, DPDE_PAD_REFLECT, 0});
    const Case full(network, {17, 6});
    Network exact = make(full);
    network.set_real(DPDE_F32);
    const Case single(network, {17, 6}, DPDE_F32);
    Network run = make(single);
    const Bars a = second(full, exact), b = second(single, run);
    EXPECT_LE(distance(joined(b.inputs, b.weights), joined(a.inputs, a.weights)), 1e-4) << named.name;
  }
}

TEST(NetworkSecond, NumberOfThreadsChangesNoBit) {
  for (const test::Named& named : test::networks()) {
    for (const Cells& cells : {Cells{2600}, Cells{65, 50}}) {
      TestNetwork network =
          named.make(static_cast<int>(cells.size()), {DPDE_PAD_PERIODIC, DPDE_PAD_REFLECT, DPDE_PAD_ZERO});
      network.set_real(DPDE_F32);
      const Case c(network, cells);
      Network one = make(c, 1), three = make(c, 3);
      const Bars a = second(c, one), b = second(c, three);
      EXPECT_EQ(joined(a.inputs, a.weights), joined(b.inputs, b.weights)) << named.name;
      EXPECT_EQ(joined(a.input_rates, a.weight_rates), joined(b.input_rates, b.weight_rates)) << named.name;
    }
  }
}

TEST(NetworkSecond, OnlyWhatIsWanted) {
  TestNetwork network(2, 3, {});
  network.conv({5});
  network.activate(DPDE_SILU);
  network.conv({2});
  Case c(network, {18, 5});
  Network run = make(c);
  const Bars all = second(c, run);
  const test::Fields in(c.layout, c.inputs), rates(c.layout, c.rates), seeds(c.layout, c.seeds), out(c.layout, 3);
  std::vector<double> weights(all.weights.size(), 1.5);
  run.second({.inputs = in.pointers(),
              .input_rates = rates.pointers(),
              .seeds = seeds.pointers(),
              .weight_rates = c.weight_rates.data(),
              .weight_bars = weights.data()});
  for (size_t i = 0; i < weights.size(); ++i) EXPECT_NEAR(weights[i], all.weights[i] + 1.5, 1e-12);
  void* one[] = {nullptr, out.pointers()[1], nullptr};
  run.second({.inputs = in.pointers(),
              .input_rates = rates.pointers(),
              .seeds = seeds.pointers(),
              .input_bars = one,
              .weight_rates = c.weight_rates.data()});
  EXPECT_EQ(out.values()[1], all.inputs[1]);
  EXPECT_TRUE(std::isnan(out.values()[0][0]));
  run.second({.inputs = in.pointers(),
              .input_rates = rates.pointers(),
              .seeds = seeds.pointers(),
              .input_rate_bars = one,
              .weight_rates = c.weight_rates.data()});
  EXPECT_EQ(out.values()[1], all.input_rates[1]);
  // Missing tangents of weights mean 0.
  std::fill(c.weight_rates.begin(), c.weight_rates.end(), 0.0);
  run.second({.inputs = in.pointers(),
              .input_rates = rates.pointers(),
              .seeds = seeds.pointers(),
              .input_bars = out.pointers()});
  EXPECT_EQ(out.values(), second(c, run).inputs);
}

TEST(NetworkSecond, RunsAllocateNothing) {
  for (const test::Named& named : test::networks()) {
    TestNetwork network = named.make(2, {DPDE_PAD_PERIODIC, DPDE_PAD_REPLICATE, 0});
    const Case c(network, {40, 31});
    Network run = make(c);
    const test::Fields in(c.layout, c.inputs), rates(c.layout, c.rates), seeds(c.layout, c.seeds),
        bars(c.layout, c.inputs.size()), rate_bars(c.layout, c.inputs.size());
    std::vector<double> weights(c.weights.size()), weight_rates(c.weights.size());
    const long before = test::allocations();
    run.second({in.pointers(), rates.pointers(), seeds.pointers(), bars.pointers(), rate_bars.pointers(),
                c.weight_rates.data(), weights.data(), weight_rates.data()});
    EXPECT_EQ(test::allocations(), before) << named.name;
  }
}

}  // namespace
}  // namespace dpde
