// SPDX-License-Identifier: Apache-2.0
#include "base/reversal.h"

#include <gtest/gtest.h>

#include <deque>

namespace dpde {
namespace {

/// States that equal their number.
struct NumberedStates {
  std::deque<int> values;
  std::deque<StateBuffer> buffers;

  const StateBuffer& operator()(int i) {
    EXPECT_LE(static_cast<std::size_t>(i), buffers.size()) << "one after the other";
    if (static_cast<std::size_t>(i) == buffers.size()) buffers.push_back({&values.emplace_back(-1)});
    return buffers[static_cast<std::size_t>(i)];
  }
  static int& of(const StateBuffer& state) { return *static_cast<int*>(state.front()); }
};

/// Two reversals, as for repeated gradients.
TEST(Reversal, ComesToEachLegWithTheStateItBeginsWith) {
  for (int legs = 0; legs <= 30; ++legs) {
    for (int slots = 1; slots <= 8; ++slots) {
      SCOPED_TRACE(::testing::Message() << legs << " legs, " << slots << " slots");
      Reversal reversal(legs, slots);
      NumberedStates spare;
      const auto buffer = [&](int i) -> const StateBuffer& { return spare(i); };
      for (int turn = 0; turn < 2; ++turn) {
        int first = 0, advanced = 0, left = legs;
        const auto advance = [&](int leg, const StateBuffer& from, const StateBuffer& to) {
          EXPECT_NE(&from, &to);
          EXPECT_EQ(NumberedStates::of(from), leg);
          NumberedStates::of(to) = leg + 1;
          ++advanced;
          return true;
        };
        const auto reverse = [&](int leg, const StateBuffer& state) {
          EXPECT_EQ(leg, --left);
          NumberedStates::of(reversal.unused(buffer)) = -1;
          EXPECT_EQ(NumberedStates::of(state), leg);
          return true;
        };
        EXPECT_TRUE(reversal.run({&first}, buffer, advance, reverse));
        EXPECT_EQ(left, 0);
        EXPECT_EQ(first, 0);
        EXPECT_EQ(advanced, checkpoint::advanced_steps(legs, slots));
        EXPECT_LE(spare.buffers.size(), static_cast<std::size_t>(slots) + 1);
      }
    }
  }
}

TEST(Reversal, StopsWhereItIsTold) {
  Reversal reversal(9, 3);
  NumberedStates spare;
  int first = 0, calls = 0;
  const auto buffer = [&](int i) -> const StateBuffer& { return spare(i); };
  const auto advance = [&](int, const StateBuffer&, const StateBuffer&) { return true; };
  EXPECT_FALSE(reversal.run({&first}, buffer, advance, [&](int, const StateBuffer&) { return ++calls < 4; }));
  EXPECT_EQ(calls, 4);
}

}  // namespace
}  // namespace dpde
