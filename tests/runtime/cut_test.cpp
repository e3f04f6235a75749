// SPDX-License-Identifier: Apache-2.0
// Truncated gradients equal the gradients of the pieces between the cuts, each started from the state of the whole run
// there.
#include <gtest/gtest.h>

#include <cmath>

#include "rollout_cases.h"

namespace dpde {
namespace {

using namespace test;

constexpr int steps = 12;

std::vector<int> steps_between(int first, int last) {
  std::vector<int> all;
  for (int k = first; k <= last; ++k) all.push_back(k);
  return all;
}

/// A loss at each state after the first, each with a separate target.
RolloutSetup setup_of(BurgersCase& burgers, int first, int last) {
  RolloutSetup setup = burgers.setup(last - first, {}, steps_between(1, last - first));
  for (int k = first + 1; k <= last; ++k)
    setup.losses[0].data[0].at[static_cast<size_t>(k - first - 1)] = burgers.targets[static_cast<size_t>(k % 4)].base();
  return setup;
}

std::vector<double> state_at(BurgersCase& burgers, const std::vector<double>& start, int step) {
  if (step == 0) return start;
  Rollout run(burgers.setup(step, {}, {}));
  run.initial(0).copy_in(start);
  run.run();
  std::vector<double> state(start.size());
  copy_out(burgers.layout, run.final_states()[0], state);
  return state;
}

TEST(Cut, IsTheSumOfThePieces) {
  BurgersCase burgers;
  const std::vector<double> start = random_values(cells, 1);
  for (const int cut : {1, 2, 5, 11, 12, 100}) {
    double loss = 0, nu_bar = 0;
    std::vector<double> start_bar;
    for (int first = 0; first < steps; first += cut) {
      Rollout piece(setup_of(burgers, first, std::min(first + cut, steps)));
      piece.initial(0).copy_in(state_at(burgers, start, first));
      const GradientResult& result = piece.gradient();
      loss += result.loss;
      nu_bar += result.param_bars[0];
      if (first == 0) start_bar = bars_of(burgers.layout, result);
    }
    for (const int slots : {1, 3, 100}) {
      RolloutSetup setup = setup_of(burgers, 0, steps);
      setup.cut = cut;
      setup.slots = slots;
      Rollout whole(std::move(setup));
      whole.initial(0).copy_in(start);
      const GradientResult& result = whole.gradient();
      EXPECT_NEAR(result.loss, loss, 1e-12 * loss) << cut;
      EXPECT_NEAR(result.param_bars[0], nu_bar, 1e-11 * std::abs(nu_bar)) << cut << " " << slots;
      const std::vector<double> bars = bars_of(burgers.layout, result);
      for (size_t i = 0; i < bars.size(); ++i) EXPECT_NEAR(bars[i], start_bar[i], 1e-12) << cut << " " << slots;
    }
  }
}

TEST(Cut, ChangesTheGradient) {
  BurgersCase burgers;
  const auto nu_bar = [&](int cut) {
    RolloutSetup setup = setup_of(burgers, 0, steps);
    setup.cut = cut;
    Rollout run(std::move(setup));
    run.initial(0).copy_in(random_values(cells, 1));
    return run.gradient().param_bars[0];
  };
  EXPECT_EQ(nu_bar(0), nu_bar(steps));
  EXPECT_GT(std::abs(nu_bar(0) - nu_bar(1)), 1e-3 * std::abs(nu_bar(0)));
}

}  // namespace
}  // namespace dpde
