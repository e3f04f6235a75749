// SPDX-License-Identifier: Apache-2.0
// Verdicts on random scenes against runs of their steps. DPDE_RANDOM_SCENES: how many (12; 1000 with DPDE_THOROUGH=1);
// DPDE_RANDOM_SEED: the first of their seeds (1); DPDE_RANDOM_TELL=1: each verdict; DPDE_RANDOM_SHORT=1: failures as
// they are, not the smallest text that fails so.
#include <gtest/gtest.h>

#include <iostream>
#include <map>

#include "limits/check_limit.h"
#include "limits/random_scene.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

std::string smallest(const Part& scene, const LimitCheck& check) {
  const auto fails = [&](const std::string& text) { return check_limit(text).kind == check.kind; };
  return print(shrink(scene, fails, 200, 30));
}

TEST(RandomLimits, AreThoseOfRuns) {
  const std::uint64_t first = setting("DPDE_RANDOM_SEED", 1),
                      count = setting("DPDE_RANDOM_SCENES", is_thorough() ? 1000 : 12);
  const bool is_short = setting("DPDE_RANDOM_SHORT", 0) != 0;
  std::map<std::string, int> total;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    const Part scene = random_scene(seed);
    const LimitCheck check = check_limit(print(scene));
    ++total[name_of(check.kind)];
    if (setting("DPDE_RANDOM_TELL", 0) != 0)
      std::cout << "seed " << seed << " " << name_of(check.kind) << " " << check.detail << "\n" << std::flush;
    if (check.kind != LimitCheck::Kind::too_high && check.kind != LimitCheck::Kind::too_low) continue;
    const std::string text = is_short ? print(scene) : smallest(scene, check);
    ADD_FAILURE() << "seed " << seed << ": " << name_of(check.kind) << "; " << check.detail
                  << "\nthe smallest text that fails so:\n"
                  << text << check_limit(text).detail;
  }
  for (const auto& [name, times] : total) std::cout << name << " " << times << "\n";
  EXPECT_LE(total["refused"], static_cast<int>(count) / 10);
}

}  // namespace
}  // namespace dpde::testing
