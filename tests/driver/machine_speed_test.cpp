// SPDX-License-Identifier: Apache-2.0
// The machine's speed is measured once, in an undisturbed moment.
#include "driver/memory/machine_speed.h"

#include <gtest/gtest.h>

#include <map>
#include <thread>

namespace dpde::driver {
namespace {

class Kept : public codegen::CodeCache {
 public:
  std::optional<std::string> find(std::string_view key) override {
    const auto found = entries.find(std::string(key));
    return found == entries.end() ? std::nullopt : std::optional(found->second);
  }
  void store(std::string_view key, std::string_view code) override { entries[std::string(key)] = code; }
  std::map<std::string, std::string> entries;
};

TEST(MachineSpeed, IsPlausible) {
  const MachineSpeed speed = machine_speed(nullptr, 1 << 16, 1);
  EXPECT_GT(speed.copy, 1e8);
  EXPECT_LT(speed.copy, 1e13);
  EXPECT_GT(speed.flops, 1e8);
  EXPECT_LT(speed.flops, 1e12);
  EXPECT_EQ(speed.date.size(), 16u) << speed.date;
  EXPECT_FALSE(speed.from_cache);
  EXPECT_DOUBLE_EQ(speed.points(16, 0), speed.copy / 16);
  EXPECT_DOUBLE_EQ(speed.points(1e-9, 100), speed.flops / 100);
}

TEST(MachineSpeed, TheMachineHasAName) {
  const std::string name = machine_name(), cores = fmt::format(", {} core", std::thread::hardware_concurrency());
  EXPECT_GT(name.find(cores), 0u);
  EXPECT_NE(name.find(cores), std::string::npos) << name;
}

TEST(MachineSpeed, OfAQuietMomentIsKept) {
  Kept cache;
  machine_speed(&cache, 1 << 16, 1);
  ASSERT_EQ(cache.entries.size(), 1u);
  const std::string today = machine_speed(nullptr, 1 << 16, 1).date;
  cache.entries.begin()->second = "123 456 0 0.25 " + today;
  const MachineSpeed kept = machine_speed(&cache, (1 << 16) + 5000, 1);
  EXPECT_TRUE(kept.from_cache);
  EXPECT_EQ(kept.copy, 123);
  EXPECT_EQ(kept.flops, 456);
  EXPECT_EQ(kept.load, 0.25);
  EXPECT_EQ(kept.date, today);
  EXPECT_FALSE(machine_speed(&cache, 1 << 22, 1).from_cache) << "of another size";
  EXPECT_FALSE(machine_speed(&cache, 1 << 16, 2).from_cache) << "on other threads";
  EXPECT_GT(machine_speed(&cache, 1 << 16, 1, true).copy, 1e8) << "anew";
}

/// An old measurement is repeated, and better numbers are kept; in a busy moment all stays as it is.
TEST(MachineSpeed, OfAnotherDayIsRenewed) {
  Kept cache;
  machine_speed(&cache, 1 << 16, 1);
  cache.entries.begin()->second = "1e15 1e-3 0 0.1 2026-01-02 03:04";
  const MachineSpeed again = machine_speed(&cache, 1 << 16, 1);
  EXPECT_EQ(again.copy, 1e15);
  EXPECT_EQ(again.from_cache, again.flops == 1e-3) << "either nothing or the better number is new";
  EXPECT_EQ(again.from_cache, again.date == "2026-01-02 03:04");
  EXPECT_FALSE(again.is_busy);
}

TEST(MachineSpeed, OfABusyMomentIsMeasuredAgainAndTheBestStays) {
  Kept cache;
  machine_speed(&cache, 1 << 16, 1);
  cache.entries.begin()->second = "1e15 1e-3 1 3.5 2026-01-02 03:04";
  const MachineSpeed again = machine_speed(&cache, 1 << 16, 1);
  EXPECT_FALSE(again.from_cache);
  EXPECT_EQ(again.copy, 1e15);
  EXPECT_GT(again.flops, 1e8);
  cache.entries.begin()->second = "what is this";
  EXPECT_GT(machine_speed(&cache, 1 << 16, 1).copy, 1e8) << "damaged";
}

}  // namespace
}  // namespace dpde::driver
