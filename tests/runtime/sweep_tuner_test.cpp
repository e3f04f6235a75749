// SPDX-License-Identifier: Apache-2.0
// Choice among equivalent ways to sweep: from reported times, stored as text.
#include "exec/sweep_tuner.h"

#include <gtest/gtest.h>

namespace dpde {
namespace {

SweepTuner tuner() {
  return {{0, 1, 64},
          {{&SweepChoice::variant, 1},
           {&SweepChoice::variant, 2},
           {&SweepChoice::prefetches, 0},
           {&SweepChoice::tile, 32},
           {&SweepChoice::planes, 2}}};
}

/// Runs until the choice is made; every fourth run is disturbed.
template <class Seconds>
SweepTuner tuned(const Seconds& seconds) {
  SweepTuner result = tuner();
  for (int run = 0; !result.is_done(); ++run) {
    EXPECT_LT(run, 100);
    result.took(seconds(result.choice()) * (run % 4 == 0 ? 3 : 1));
  }
  return result;
}

TEST(SweepTuner, TakesWhatIsFaster) {
  const SweepTuner found = tuned([](const SweepChoice& c) {
    return (c.variant == 2 ? 0.8 : 1.0) * (c.prefetches == 0 ? 0.9 : 1.0) * (c.tile == 32 ? 1.3 : 1.0) *
           (c.planes == 2 ? 0.7 : 1.0);
  });
  EXPECT_EQ(found.choice(), (SweepChoice{2, 0, 64, 2}));
  EXPECT_EQ(found.text(), "2 0 64 2");
}

TEST(SweepTuner, StaysWhereNothingIsClearlyFaster) {
  const SweepTuner found = tuned([](const SweepChoice& c) { return 1 - 0.005 * static_cast<double>(c.variant); });
  EXPECT_EQ(found.choice(), (SweepChoice{0, 1, 64}));
}

TEST(SweepTuner, RemembersByText) {
  SweepTuner other = tuner();
  EXPECT_EQ(other.text(), "");
  EXPECT_TRUE(other.set("1 0 32 2"));
  EXPECT_TRUE(other.is_done());
  EXPECT_EQ(other.choice(), (SweepChoice{1, 0, 32, 2}));
  EXPECT_EQ(other.text(), "1 0 32 2");
}

TEST(SweepTuner, RefusesWhatIsNoChoice) {
  for (const char* text : {"", "1", "1 0", "0 1 64", "3 1 64 1", "-1 1 64 1", "0 2 64 1", "0 1 65 1", "0 1 64 3",
                           "x 1 64 1", "1e3 1 64 1"}) {
    SweepTuner other = tuner();
    EXPECT_FALSE(other.set(text)) << text;
    EXPECT_FALSE(other.is_done());
    EXPECT_EQ(other.choice(), (SweepChoice{0, 1, 64}));
  }
}

}  // namespace
}  // namespace dpde
