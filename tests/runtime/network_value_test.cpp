// SPDX-License-Identifier: Apache-2.0
// Networks and their tangents against the definition of their layers, cell by cell.
#include <gtest/gtest.h>

#include "dpde/runtime/error.h"
#include "network_run.h"

namespace dpde {
namespace {

using test::Case;
using test::Cells;
using test::Dense;
using test::TestNetwork;
using test::Values;
using Conv = TestNetwork::Conv;

/// The largest difference, relative to the largest value if that exceeds 1.
double difference(const Values& found, const Dense& expected, double test::Dual::*part) {
  double most = 0, size = 1;
  for (size_t c = 0; c < found.size(); ++c) {
    for (size_t i = 0; i < found[c].size(); ++i) {
      const double value = expected.channels[c][i].*part, error = std::abs(found[c][i] - value);
      size = std::max(size, std::abs(value));
      most = error <= most ? most : error;  // NaN is kept
    }
  }
  return most / size;
}

TEST(NetworkValue, EveryLayerIsWhatItsDefinitionSays) {
  int checked = 0;
  test::for_each_case([&](TestNetwork& network, const Cells& cells, const std::string& what) {
    const Case c(network, cells);
    const Dense expected = c.expected();
    Network run = c.make();
    EXPECT_LE(difference(c.value(run), expected, &test::Dual::v), 1e-12) << what;
    EXPECT_LE(difference(c.tangent(run), expected, &test::Dual::d), 1e-12) << what << ", rates";
    EXPECT_LE(difference(c.value(run), expected, &test::Dual::v), 1e-12) << what << ", again";
    ++checked;
  });
  EXPECT_GT(checked, 2000);
}

TEST(NetworkValue, SinglePrecision) {
  test::for_each_case([&](TestNetwork& network, const Cells& cells, const std::string& what) {
    if (cells.size() != 2) return;  // the same code
    network.set_real(DPDE_F32);
    const Case c(network, cells);
    Network run = c.make();
    EXPECT_LE(difference(c.value(run), c.expected(), &test::Dual::v), 3e-5) << what;
  });
}

TEST(NetworkValue, FieldsOfAnotherPrecision) {
  for (const int32_t real : {DPDE_F32, DPDE_F64}) {
    TestNetwork network(2, 2, {}, real);
    network.conv(Conv{9});
    network.activate(DPDE_TANH);
    network.conv(Conv{2});
    const Case c(network, {21, 6}, real == DPDE_F32 ? DPDE_F64 : DPDE_F32);
    Network run = c.make();
    EXPECT_LE(difference(c.value(run), c.expected(), &test::Dual::v), 1e-5);
    EXPECT_LE(difference(c.tangent(run), c.expected(), &test::Dual::d), 1e-5);
  }
}

TEST(NetworkValue, ManyCellsInBlocks) {
  TestNetwork network(2, 3, {});
  network.conv(Conv{9, 1});
  network.activate(DPDE_GELU);
  network.conv(Conv{2, 1});
  const Case c(network, {53, 41});  // not a multiple of a block
  Network run = c.make();
  EXPECT_LE(difference(c.value(run), c.expected(), &test::Dual::v), 1e-12);
  EXPECT_LE(difference(c.tangent(run), c.expected(), &test::Dual::d), 1e-12);
}

/// One activation of values along a row, including extreme ones.
TEST(NetworkValue, ActivationsFarOut) {
  for (const int32_t real : {DPDE_F64, DPDE_F32}) {
    for (int kind = DPDE_RELU; kind <= DPDE_SILU; ++kind) {
      TestNetwork network(1, 1, {}, real);
      network.activate(kind);
      Case c(network, {4001});
      for (size_t i = 0; i < c.inputs[0].size(); ++i)
        c.inputs[0][i] = real == DPDE_F32 ? static_cast<float>(1e-2 * (double(i) - 2000)) : 1e-2 * (double(i) - 2000);
      c.inputs[0][0] = -1e4;
      c.inputs[0][2] = 1e-7f;
      Network run = c.make();
      const Dense expected = c.expected();
      const Values values = c.value(run), rates = c.tangent(run);
      for (size_t i = 0; i < values[0].size(); ++i) {
        const test::Dual exact = expected.channels[0][i];
        EXPECT_LE(std::abs(values[0][i] - exact.v), std::abs(exact.v) * (real == DPDE_F32 ? 3e-5 : 1e-13) + 1e-33)
            << kind << " of " << c.inputs[0][i];
        EXPECT_LE(std::abs(rates[0][i] - exact.d), real == DPDE_F32 ? 5e-7 : 1e-14) << kind << " of " << c.inputs[0][i];
      }
      c.inputs[0][7] = std::nan("");
      EXPECT_TRUE(std::isnan(c.value(run)[0][7])) << kind;
    }
  }
}

TEST(NetworkValue, OutputsMayBeTheInputs) {
  TestNetwork network(2, 2, {});
  network.conv(Conv{2});
  const Case c(network, {21, 6});
  Network run = c.make();
  const test::Fields fields(c.layout, c.inputs);
  run.value(fields.pointers(), fields.pointers());
  EXPECT_EQ(fields.values(), c.value(run));
}

TEST(NetworkValue, WeightsThatNetworksBeginWith) {
  TestNetwork network(2, 40, {});
  network.conv({.channels = 40, .groups = 2});
  dpde_network table = network.table();
  dpde_layer layer = table.layers[0];
  table.layers = &layer;
  const auto moments = [&] {
    const std::vector<double> weights = initial_weights(table, 3);
    double sum = 0, square = 0, most = 0;
    const auto count = static_cast<size_t>(layer.bias);
    for (size_t i = 0; i < count; ++i) {
      sum += weights[i];
      square += weights[i] * weights[i];
      most = std::max(most, std::abs(weights[i]));
    }
    for (size_t i = count; i < weights.size(); ++i) EXPECT_EQ(weights[i], 0);
    return std::array<double, 3>{sum / double(count), std::sqrt(square / double(count)), most};
  };
  const double he = 0.5 * std::sqrt(2.0 / 180), xavier = 0.5 * std::sqrt(6.0 / 360);
  layer.gain = 0.5;
  EXPECT_NEAR(moments()[0], 0, he * 0.03);
  EXPECT_NEAR(moments()[1], he, he * 0.03);
  layer.init = DPDE_INIT_XAVIER;
  EXPECT_NEAR(moments()[0], 0, xavier * 0.03);
  EXPECT_NEAR(moments()[1], xavier / std::sqrt(3.0), xavier * 0.03);
  EXPECT_LE(moments()[2], xavier);
  EXPECT_GT(moments()[2], 0.99 * xavier);
  layer.init = DPDE_INIT_ZERO;
  EXPECT_EQ(moments()[2], 0);
  layer.init = DPDE_INIT_HE;
  EXPECT_NE(initial_weights(table, 3), initial_weights(table, 4));
  EXPECT_EQ(initial_weights(table, 3), initial_weights(table, 3));
}

std::string refusal(const dpde_network& network, const Cells& cells) {
  try {
    const Network run(network, make_layout(cells, {}));
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    return error.what();
  }
  return "accepted";
}

TEST(NetworkValue, BrokenNetworksAreRefused) {
  TestNetwork good(2, 2, {});
  good.conv({.channels = 4, .stride = 2});
  good.pool(DPDE_UPSAMPLE, 2);
  EXPECT_EQ(refusal(good.table(), {5, 5}), "accepted");
  EXPECT_EQ(refusal(good.table(), {5}), "the network `test` has 2 axes, the grid 1");
  TestNetwork coarse(1, 2, {});
  coarse.pool(DPDE_MEAN_POOL, 2);
  EXPECT_EQ(refusal(coarse.table(), {8}), "the network `test` ends on a grid that is coarser by 2");
  coarse.join(DPDE_ADD, 0, 1);
  EXPECT_EQ(refusal(coarse.table(), {8}),
            "the network `test` has a layer 2 that joins values of grids coarser by 1 and by 2");
  TestNetwork fine(1, 2, {});
  fine.pool(DPDE_UPSAMPLE, 2);
  EXPECT_EQ(refusal(fine.table(), {8}),
            "the network `test` has a layer 1 that makes a grid that is coarser by 1 finer by 2");
  dpde_network lacks = good.table();
  lacks.weight_count -= 1;
  EXPECT_EQ(refusal(lacks, {5, 5}), "the network `test` has a layer 1 that has biases that are not there");
}

}  // namespace
}  // namespace dpde
