// SPDX-License-Identifier: Apache-2.0
// Adjoints that use stored forward values equal those that recompute them, bit for bit.
#include <gtest/gtest.h>

#include "allocations.h"
#include "dpde/runtime/tapes.h"
#include "network_run.h"

namespace dpde {
namespace {

using test::Case;
using test::Cells;
using test::TestNetwork;
using test::Values;

/// One network for the steps and one for their adjoints, as in a rollout.
struct Both {
  Network forward, backward;
  std::shared_ptr<Tapes> tapes;

  Both(const Case& c, int64_t count, int threads = 1) : forward(c.make(threads)), backward(c.make(threads)) {
    if (forward.tape_bytes() == 0) return;
    tapes = std::make_shared<Tapes>(forward.tape_bytes(), count);
    forward.write_tapes(tapes);
    backward.read_tapes(tapes);
    tapes->record(true);
  }
};

void expect_same(const Case& c, Both& both, int64_t found, const std::string& what) {
  Network alone = c.make();
  const Case::Bars expected = c.adjoint(alone), bars = c.adjoint(both.backward);
  EXPECT_EQ(bars.inputs, expected.inputs) << what;
  EXPECT_EQ(bars.weights, expected.weights) << what;
  EXPECT_EQ(both.tapes->found(), found) << what;
}

TEST(Tapes, HoldWhatAdjointsWouldComputeAgain) {
  for (const int32_t real : {DPDE_F64, DPDE_F32}) {
    test::for_each_case([&](TestNetwork& network, const Cells& cells, const std::string& what) {
      network.set_real(real);
      const Case c(network, cells);
      Network alone = c.make();
      for (const int threads : cells.size() == 2 ? std::vector{1, 3} : std::vector{1}) {
        Both both(c, 2, threads);
        ASSERT_NE(both.tapes, nullptr) << what;
        EXPECT_EQ(c.value(both.forward), c.value(alone)) << what << ", the value itself";
        expect_same(c, both, 1, what);
        expect_same(c, both, 1, what + ", no longer there");
      }
    });
  }
}

TEST(Tapes, AreFoundInAnyOrderAndWhereThereIsNoRoomTheLastOnesAre) {
  TestNetwork network(2, 2, {DPDE_PAD_REPLICATE, DPDE_PAD_PERIODIC, 0});
  network.conv({.channels = 5});
  network.activate(DPDE_GELU);
  network.conv({.channels = 2});
  std::vector<Case> steps(5, Case(network, {9, 7}));
  for (size_t k = 0; k < steps.size(); ++k)
    steps[k].inputs[1][62] = static_cast<double>(k);  // they differ in their last cell
  Both both(steps[0], 3);
  for (const Case& step : steps) step.value(both.forward);
  expect_same(steps[3], both, 1, "not the last");
  expect_same(steps[4], both, 2, "the last");
  expect_same(steps[0], both, 2, "given up for a later one");
  steps[0].value(both.forward);  // a recomputed step
  steps[1].value(both.forward);
  Network alone = steps[1].make();
  EXPECT_EQ(steps[1].value(both.backward), steps[1].value(alone)) << "a reader that only wants the value";
  both.tapes->record(false);
  steps[4].value(both.forward);
  both.tapes->record(true);
  expect_same(steps[4], both, 0, "not recorded");
  expect_same(steps[1], both, 1, "again");
  expect_same(steps[2], both, 2, "there since the first pass");
}

TEST(Tapes, AreOfTheWeightsThatThereAre) {
  TestNetwork network(2, 2, {});
  network.conv({.channels = 2});
  network.activate(DPDE_TANH);
  Case c(network, {9, 7});
  Both both(c, 2);
  c.value(both.forward);
  both.forward.set_weights(c.weights.data());
  both.backward.set_weights(c.weights.data());
  expect_same(c, both, 1, "the same weights once more");
  c.value(both.forward);
  c.weights[3] = 0.125;
  both.forward.set_weights(c.weights.data());
  both.backward.set_weights(c.weights.data());
  expect_same(c, both, 1, "other weights");
}

TEST(Tapes, AreNoLongerWrittenWhereNoneIsEverFound) {
  TestNetwork network(1, 1, {});
  network.conv({.channels = 1});
  Case c(network, {5}), other = c;
  other.inputs[0][0] += 1e-9;
  Both both(c, 2);
  for (int k = 0; k < 100; ++k) {
    c.value(both.forward);
    other.adjoint(both.backward);
  }
  EXPECT_FALSE(both.tapes->is_recording());
  expect_same(c, both, 1, "written before");
  EXPECT_TRUE(both.tapes->is_recording()) << "of use after all";
}

TEST(Tapes, AllocateNothingInARun) {
  TestNetwork network(2, 2, {});
  network.conv({.channels = 4});
  network.activate(DPDE_SILU);
  network.conv({.channels = 2});
  const Case c(network, {17, 6});
  Both both(c, 2);
  const test::Fields in(c.layout, c.inputs), out(c.layout, c.seeds), bars(c.layout, c.inputs.size());
  std::vector<double> weight_bars(c.weights.size());
  const long before = test::allocations();
  for (int k = 0; k < 3; ++k) {
    for (int run = 0; run < 3; ++run) both.forward.value(in.pointers(), out.pointers());
    for (int run = 0; run < 3; ++run)
      both.backward.adjoint(in.pointers(), out.pointers(), bars.pointers(), weight_bars.data());
    both.forward.set_weights(c.weights.data());
  }
  EXPECT_EQ(test::allocations(), before);
  EXPECT_EQ(both.tapes->found(), 6);
}

}  // namespace
}  // namespace dpde
