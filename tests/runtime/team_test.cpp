// SPDX-License-Identifier: Apache-2.0
// Thread teams: every part runs once, for all sizes, nested, from several callers, and with exceptions.
#include "dpde/runtime/team.h"

#include <gtest/gtest.h>
#include <pthread.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "dpde/runtime/float_mode.h"
#include "dpde/runtime/thread_ranks.h"

namespace dpde {
namespace {

TEST(Team, DoesEveryPartOnce) {
  for (const int threads : {1, 2, 3, 8}) {
    const Team team(threads);
    for (const std::int64_t parts : {0, 1, 2, 3, 7, 8, 100, 59999, 60001, 200000}) {
      std::vector<std::atomic<int>> times(static_cast<std::size_t>(parts));
      std::atomic<bool> numbers_fit{true};
      team.run(parts, [&](std::int64_t part, int thread) {
        ++times[static_cast<std::size_t>(part)];
        if (thread < 0 || thread >= threads || thread >= std::max<std::int64_t>(parts, 1)) numbers_fit = false;
      });
      for (const std::atomic<int>& each : times) ASSERT_EQ(each, 1) << parts << " parts, " << threads << " threads";
      EXPECT_TRUE(numbers_fit);
    }
  }
}

/// The results of one task are available to the next; no earlier work is done late.
TEST(Team, WorksOneAfterTheOther) {
  std::vector<std::uint64_t> values(64, 0);  // unsigned: they wrap around
  Team team(4);
  for (std::int64_t round = 0; round < 4000; ++round) {
    if (round % 40 == 0) team = 4;  // on a busy machine a long-running team sleeps
    team.run(1 + round % 64, [&](std::int64_t part, int) {
      std::uint64_t& value = values[static_cast<std::size_t>(part)];
      value = value * 31 + static_cast<std::uint64_t>(round);
    });
  }
  std::vector<std::uint64_t> wanted(64, 0);
  for (std::uint64_t round = 0; round < 4000; ++round) {
    for (std::uint64_t part = 0; part <= round % 64; ++part) {
      std::uint64_t& value = wanted[part];
      value = value * 31 + round;
    }
  }
  EXPECT_EQ(values, wanted);
}

/// No two concurrent parts have the same thread number.
TEST(Team, AThreadDoesOnePartAtATime) {
  std::array<std::atomic<int>, 3> inside{};
  std::atomic<bool> overlaps{false};
  for (int round = 0; round < 100; ++round) {
    const Team team(3);
    team.run(12, [&](std::int64_t, int thread) {
      if (++inside[static_cast<std::size_t>(thread)] != 1) overlaps = true;
      --inside[static_cast<std::size_t>(thread)];
    });
  }
  EXPECT_FALSE(overlaps);
}

/// Two parts that wait for each other: needs two concurrent threads.
TEST(Team, ThreadsWorkAtTheSameTime) {
  const Team team(2);
  std::atomic<int> arrived{0};
  std::array<std::thread::id, 2> ids;
  team.run(2, [&](std::int64_t part, int thread) {
    ids[static_cast<std::size_t>(part)] = std::this_thread::get_id();
    EXPECT_EQ(thread == 0, part == 0);
    ++arrived;
    while (arrived < 2) std::this_thread::yield();
  });
  EXPECT_EQ(ids[0], std::this_thread::get_id());
  EXPECT_NE(ids[1], ids[0]);
}

TEST(Team, TheFirstExceptionComesHomeAndTheTeamGoesOn) {
  for (const int threads : {1, 2, 4}) {
    for (int round = 0; round < 40; ++round) {
      const Team team(threads);
      std::string what;
      try {
        team.run(16, [](std::int64_t part, int) {
          if (part % 5 == 3) throw std::runtime_error(std::to_string(part));
        });
      } catch (const std::runtime_error& error) {
        what = error.what();
      }
      EXPECT_EQ(what, "3");
      std::atomic<int> done{0};
      team.run(16, [&](std::int64_t, int) { ++done; });
      ASSERT_EQ(done, 16);
    }
  }
}

TEST(Team, WorkWithinWorkAndCallersAtOnce) {
  const Team team(3);
  std::atomic<std::int64_t> sum{0};
  const auto nested = [&] {
    team.run(6, [&](std::int64_t outer, int) {
      team.run(5, [&, outer](std::int64_t inner, int) { sum += 10 * outer + inner; });
    });
  };
  nested();
  EXPECT_EQ(sum, 5 * 150 + 6 * 10);
  sum = 0;
  {
    const std::jthread other([&] {
      for (int i = 0; i < 200; ++i) nested();
    });
    for (int i = 0; i < 200; ++i) nested();
  }
  EXPECT_EQ(sum, 400 * (5 * 150 + 6 * 10));
}

/// A copy is the same team; the last one ends it, in any state of its threads.
TEST(Team, EndsAtAnyTime) {
  for (int i = 0; i < 200; ++i) {
    Team team(3);
    const Team copy = team;
    std::atomic<int> done{0};
    if (i % 3 > 0) copy.run(8, [&](std::int64_t, int) { ++done; });
    if (i % 3 == 2) std::this_thread::sleep_for(std::chrono::microseconds(50));  // they may sleep by now
    team = 1;
    EXPECT_EQ(done, i % 3 > 0 ? 8 : 0);
  }
}

/// If threads cannot be created, the others do their work.
TEST(Team, ThreadsThatCannotBeMadeAreMissedByNobody) {
  pthread_attr_t usual, huge;
  ASSERT_EQ(pthread_getattr_default_np(&usual), 0);
  ASSERT_EQ(pthread_attr_init(&huge), 0);
  ASSERT_EQ(pthread_attr_setstacksize(&huge, std::size_t{1} << 46), 0);
  ASSERT_EQ(pthread_setattr_default_np(&huge), 0);
  const Team team(4);
  std::atomic<int> done{0};
  for (int i = 0; i < 20; ++i) team.run(100, [&](std::int64_t, int thread) { done += thread == 0 ? 1 : 0; });
  EXPECT_THROW(run_ranks({2, 1, 1}, [](Communicator&) {}), std::system_error);
  ASSERT_EQ(pthread_setattr_default_np(&usual), 0);
  EXPECT_EQ(done, 2000);
  pthread_attr_destroy(&huge);
  pthread_attr_destroy(&usual);
}

/// The caller's mode; each thread's own mode is restored afterwards.
TEST(Team, ThreadsHaveTheFloatingPointModeOfTheCaller) {
  if (mode_without_subnormals() == float_mode()) GTEST_SKIP() << "this processor's mode cannot be set";
  for (const bool flushes : {true, false, true}) {
    const Team team(2);  // a new team does not sleep
    const FloatScope scope(flushes ? mode_without_subnormals() : float_mode());
    std::array<volatile double, 2> halves{};
    std::atomic<int> arrived{0};
    team.run(2, [&](std::int64_t part, int) {
      volatile double smallest = std::numeric_limits<double>::min();
      halves[static_cast<std::size_t>(part)] = smallest / 2;
      ++arrived;
      while (arrived < 2) std::this_thread::yield();
    });
    for (const double half : halves) EXPECT_EQ(half == 0, flushes);
  }
}

/// With arbitrary delays of parts, the sum in the order of parts is the same.
TEST(Team, DelaysChangeNothing) {
  const auto results = [](int threads) {
    const Team team(threads);
    std::vector<double> parts(40), sums;
    for (int round = 0; round < 20; ++round) {
      team.run(40, [&](std::int64_t part, int thread) {
        if (thread == 1 && part % 7 == round % 7) std::this_thread::sleep_for(std::chrono::microseconds(300));
        parts[static_cast<std::size_t>(part)] = std::sin(static_cast<double>(part + round));
      });
      sums.push_back(std::accumulate(parts.begin(), parts.end(), 0.0));
    }
    return sums;
  };
  EXPECT_EQ(results(1), results(2));
  EXPECT_EQ(results(1), results(5));
}

}  // namespace
}  // namespace dpde
