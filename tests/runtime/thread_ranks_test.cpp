// SPDX-License-Identifier: Apache-2.0
// Subgrids, and communication of ranks that are threads.
#include "dpde/runtime/thread_ranks.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "dpde/runtime/error.h"
#include "dpde/runtime/field.h"
#include "dpde/runtime/layout.h"
#include "dpde/runtime/random.h"

namespace dpde {
namespace {

using Counts = std::array<int64_t, 3>;

TEST(Subgrid, KnowsItsPlace) {
  const std::vector<int64_t> global{7, 5};
  int64_t cells = 0;
  for (const int64_t x : {0, 1, 2}) {
    for (const int64_t y : {0, 1}) {
      const dpde_layout layout = make_subgrid(global, {3, 2, 1}, {x, y, 0}, {2, 1, 0});
      EXPECT_TRUE(is_divided(layout));
      EXPECT_EQ(has_low_seam(layout, 0), x > 0);
      EXPECT_EQ(has_high_seam(layout, 0), x < 2);
      EXPECT_EQ(layout.first[0], x * 7 / 3);
      EXPECT_EQ(layout.first[1], y * 2);
      EXPECT_EQ(global_cell_count(layout), 35);
      cells += cell_count(layout);
    }
  }
  EXPECT_EQ(cells, 35);
  EXPECT_FALSE(is_divided(make_subgrid(global, {1, 1, 1}, {0, 0, 0}, {2, 1, 0})));
  EXPECT_FALSE(is_divided(make_layout(global, {2, 1, 0})));
}

TEST(Subgrid, IsNotNarrowerThanItsHalo) {
  const std::vector<int64_t> global{7};
  EXPECT_NO_THROW(make_subgrid(global, {3, 1, 1}, {0, 0, 0}, {2, 0, 0}));
  EXPECT_THROW(make_subgrid(global, {3, 1, 1}, {0, 0, 0}, {3, 0, 0}), Error);
  EXPECT_THROW(make_subgrid(global, {8, 1, 1}, {0, 0, 0}, {0, 0, 0}), Error);
}

TEST(Subgrid, CoordinatesAndNoiseGoByTheNumbersOfCells) {
  const std::vector<int64_t> global{5, 4};
  const dpde_layout all = make_layout(global, {1, 1, 0});
  Field x(all), y(all), noise(all);
  fill_coordinate(x, 0, -1, 0.5, true);
  fill_coordinate(y, 1, 0, 2, false);
  fill_noise(all, noise.base(), 3, 1);
  for (const int64_t place : {0, 1, 2, 3}) {
    const dpde_layout layout = make_subgrid(global, {2, 2, 1}, {place % 2, place / 2, 0}, {1, 1, 0});
    Field own_x(layout), own_y(layout), own_noise(layout);
    fill_coordinate(own_x, 0, -1, 0.5, true);
    fill_coordinate(own_y, 1, 0, 2, false);
    fill_noise(layout, own_noise.base(), 3, 1);
    for (int64_t j = -1; j <= layout.cells[1]; ++j) {
      for (int64_t i = -1; i <= layout.cells[0]; ++i) {
        EXPECT_EQ(own_x.at(i, j), x.at(i + layout.first[0], j + layout.first[1]));
        EXPECT_EQ(own_y.at(i, j), y.at(i + layout.first[0], j + layout.first[1]));
      }
    }
    for (int64_t j = 0; j < layout.cells[1]; ++j) {
      for (int64_t i = 0; i < layout.cells[0]; ++i)
        EXPECT_EQ(own_noise.at(i, j), noise.at(i + layout.first[0], j + layout.first[1]));
    }
  }
}

/// (0.1 + 0.2) + 0.3 differs from 0.1 + (0.2 + 0.3): ranks are summed in their order.
TEST(ThreadRanks, AddUpInTheirOrder) {
  std::array<double, 3> sums{};
  run_ranks({3, 1, 1}, [&](Communicator& rank) {
    const auto place = static_cast<size_t>(rank.place()[0]);
    double value = 0.1 * static_cast<double>(place + 1);
    if (place == 2) value = 0.3;
    rank.sum({&value, 1});
    sums[place] = value;
  });
  for (const double sum : sums) EXPECT_EQ(sum, (0.1 + 0.2) + 0.3);
}

TEST(ThreadRanks, CombineAlongAxes) {
  std::array<std::array<double, 4>, 6> found{};
  run_ranks({2, 3, 1}, [&](Communicator& rank) {
    const auto [x, y, z] = rank.place();
    const auto own = static_cast<double>(10 * y + x);
    std::array<double, 4> values{own, own, -own, own};
    rank.sum({values.data(), 1}, {true, false, false});
    rank.largest({&values[1], 1}, {false, true, false});
    rank.largest({&values[2], 1});
    if (x == 1 && y == 1) values[3] = std::numeric_limits<double>::quiet_NaN();
    rank.largest({&values[3], 1}, {true, false, false});
    found[static_cast<size_t>(2 * y + x)] = values;
  });
  for (size_t y = 0; y < 3; ++y) {
    for (size_t x = 0; x < 2; ++x) {
      const std::array<double, 4>& values = found[2 * y + x];
      EXPECT_EQ(values[0], 20 * static_cast<double>(y) + 1);
      EXPECT_EQ(values[1], 20 + static_cast<double>(x));
      EXPECT_EQ(values[2], 0);
      EXPECT_EQ(std::isnan(values[3]), y == 1);
    }
  }
}

TEST(ThreadRanks, ExchangeAroundARing) {
  std::array<std::array<double, 2>, 3> found{};
  run_ranks({1, 3, 1}, [&](Communicator& rank) {
    const auto place = static_cast<size_t>(rank.place()[1]);
    const std::array<double, 2> own{static_cast<double>(place), static_cast<double>(place) + 0.5};
    std::array<double, 2> beyond{};
    rank.exchange(1, {std::as_bytes(std::span(&own[0], 1)), std::as_bytes(std::span(&own[1], 1))},
                  {std::as_writable_bytes(std::span(&beyond[0], 1)), std::as_writable_bytes(std::span(&beyond[1], 1))});
    found[place] = beyond;
  });
  EXPECT_EQ(found[0], (std::array{2.5, 1.0}));
  EXPECT_EQ(found[1], (std::array{0.5, 2.0}));
  EXPECT_EQ(found[2], (std::array{1.5, 0.0}));
}

std::string error_of(const std::function<void(Communicator& rank)>& f) {
  try {
    run_ranks({3, 1, 1}, f);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(ThreadRanks, EndWithTheFirstError) {
  EXPECT_EQ(error_of([](Communicator& rank) {
              if (rank.place()[0] == 1) throw Error(ErrorKind::run, "something happened");
              double value = 1;
              rank.sum({&value, 1});
            }),
            "something happened");
}

TEST(ThreadRanks, MakeTheSameCalls) {
  const std::string expected = "the ranks of a divided grid do not make the same calls";
  EXPECT_EQ(error_of([](Communicator& rank) {
              double value = 1;
              if (rank.place()[0] > 0) rank.sum({&value, 1});
            }),
            expected);
  EXPECT_EQ(error_of([](Communicator& rank) {
              std::vector<double> values(rank.place()[0] == 2 ? 2 : 1);
              rank.sum(values);
            }),
            expected);
}

}  // namespace
}  // namespace dpde
