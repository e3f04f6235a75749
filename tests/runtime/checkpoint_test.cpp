// SPDX-License-Identifier: Apache-2.0
// Simulates plans: every action must find its inputs, and the number of steps must be minimal.
#include "dpde/runtime/checkpoint.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "dpde/runtime/error.h"

namespace dpde::checkpoint {
namespace {

std::vector<Action> plan(int steps, int slots) {
  Schedule schedule(steps, slots);
  std::vector<Action> actions, again;
  while (const std::optional<Action> action = schedule.next()) actions.push_back(*action);
  schedule.rewind();
  while (const std::optional<Action> action = schedule.next()) again.push_back(*action);
  EXPECT_EQ(actions, again);
  return actions;
}

/// Executes a plan and returns the number of steps; an impossible action fails the test.
int64_t execute(int steps, int slots) {
  std::vector<int> slot(static_cast<size_t>(slots), -1);
  int current = 0, reversed = steps;
  int64_t advanced = 0;
  for (const Action& action : plan(steps, slots)) {
    switch (action.kind) {
      case ActionKind::advance:
        EXPECT_EQ(action.from, current);
        EXPECT_LT(action.from, action.to);
        EXPECT_LT(action.to, reversed);
        advanced += action.to - action.from;
        current = action.to;
        break;
      case ActionKind::store:
        EXPECT_EQ(action.from, current);
        slot.at(static_cast<size_t>(action.slot)) = current;
        break;
      case ActionKind::restore:
        EXPECT_EQ(action.from, slot.at(static_cast<size_t>(action.slot)));
        current = action.from;
        break;
      case ActionKind::reverse:
        EXPECT_EQ(action.from, current);
        EXPECT_EQ(action.from, reversed - 1);
        reversed = action.from;
        break;
    }
  }
  EXPECT_EQ(reversed, 0);
  return advanced;
}

TEST(Checkpoint, EveryPlanReversesAllStepsWithTheLeastWork) {
  constexpr int most = 40;
  // least[s][l]: minimum over all positions of the next checkpoint.
  std::vector<std::vector<int64_t>> least(most + 1, std::vector<int64_t>(most + 1, 0));
  for (int s = 1; s <= most; ++s) {
    for (int l = 2; l <= most; ++l) {
      auto& best = least[static_cast<size_t>(s)][static_cast<size_t>(l)];
      best = int64_t{l} * (l - 1) / 2;
      for (int m = 1; s > 1 && m < l; ++m) {
        best = std::min(best, m + least[static_cast<size_t>(s - 1)][static_cast<size_t>(l - m)] +
                                  least[static_cast<size_t>(s)][static_cast<size_t>(m)]);
      }
    }
  }
  for (int steps = 1; steps <= most; ++steps) {
    for (int slots = 1; slots <= most; ++slots) {
      const int64_t expected = least[static_cast<size_t>(slots)][static_cast<size_t>(steps)];
      EXPECT_EQ(execute(steps, slots), expected) << steps << " steps, " << slots << " slots";
      EXPECT_EQ(advanced_steps(steps, slots), expected) << steps << " steps, " << slots << " slots";
    }
  }
}

TEST(Checkpoint, StoresAllWhenItCan) {
  for (int steps = 1; steps <= 40; ++steps) {
    EXPECT_EQ(advanced_steps(steps, steps), steps - 1);
    EXPECT_EQ(advanced_steps(steps, std::max(steps - 1, 1)), steps - 1);
  }
}

TEST(Checkpoint, LongRuns) {
  EXPECT_EQ(execute(1, 1), 0);
  EXPECT_TRUE(plan(0, 3).empty());
  EXPECT_EQ(execute(20000, 20000), 19999);  // no recursion over the steps
  EXPECT_EQ(execute(2000, 1), 2000 * 1999 / 2);
  EXPECT_EQ(execute(5000, 7), advanced_steps(5000, 7));
  EXPECT_LT(advanced_steps(1000000, 30), 6 * int64_t{1000000});
  EXPECT_EQ(advanced_steps(std::numeric_limits<int>::max(), 1), int64_t{2147483647} * 2147483646 / 2);
  EXPECT_GT(advanced_steps(std::numeric_limits<int>::max(), 2), int64_t{1} << 40);
}

TEST(Checkpoint, SlotsForABudget) {
  EXPECT_EQ(slots_for(1000, 100, 100), 8);
  EXPECT_EQ(slots_for(1000, 100, 5), 4);
  EXPECT_EQ(slots_for(400, 100, 5), 2);
  EXPECT_EQ(slots_for(std::numeric_limits<int64_t>::max(), 8, 1), 1);
  EXPECT_EQ(slots_for(std::numeric_limits<int64_t>::max(), 8, 0), 1);
  EXPECT_THROW(slots_for(399, 100, 5), Error);
  EXPECT_THROW(plan(3, 0), Error);
  EXPECT_THROW(plan(-1, 1), Error);
}

}  // namespace
}  // namespace dpde::checkpoint
