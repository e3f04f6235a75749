// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/layout.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "dpde/runtime/error.h"
#include "dpde/runtime/field.h"

namespace dpde {
namespace {

TEST(Layout, RowsAreAlignedPaddedAndStaggered) {
  for (int64_t nx : {1, 7, 8, 128, 496, 1000, 1024, 4080}) {
    for (int64_t halo : {0, 1, 4, 9}) {
      const dpde_layout layout = make_layout(std::vector<int64_t>{nx, 5, 3}, {halo, halo, 1});
      EXPECT_EQ(layout.rank, 3);
      EXPECT_EQ(layout.stride[0], 1);
      EXPECT_EQ(layout.origin % 8, 0);
      for (size_t axis : {1, 2}) {
        EXPECT_EQ(layout.stride[axis] % 8, 0);
        EXPECT_NE(layout.stride[axis] % 512, 0);
      }
      EXPECT_GE(layout.stride[1], nx + 2 * std::max<int64_t>(halo, 8));
      EXPECT_GE(layout.stride[2], layout.stride[1] * (5 + 2 * halo));
      // The first and the last ghost cell, with the padding of their rows, lie inside the allocation.
      EXPECT_GE(layout.origin + index_of(layout, 0, -halo, -1), std::max<int64_t>(halo, 8));
      EXPECT_LE(layout.origin + index_of(layout, nx, 4 + halo, 3) + std::max<int64_t>(halo, 8), layout.size);
    }
  }
}

TEST(Layout, RowsOfFloatsBeginOnLinesToo) {
  for (int64_t nx : {1, 15, 16, 128, 992, 1000, 2048}) {
    for (int64_t halo : {0, 1, 17}) {
      const dpde_layout layout = make_layout(std::vector<int64_t>{nx, 5, 3}, {halo, halo, 1}, DPDE_F32);
      EXPECT_EQ(layout.origin * 4 % 64, 0);
      for (size_t axis : {1, 2}) {
        EXPECT_EQ(layout.stride[axis] * 4 % 64, 0);
        EXPECT_NE(layout.stride[axis] * 4 % 4096, 0);
      }
      EXPECT_GE(layout.stride[1], nx + 2 * std::max<int64_t>(halo, 16));
      EXPECT_EQ(field_bytes(layout), layout.size * 4);
    }
  }
}

TEST(Layout, AxesBeyondTheRankHaveOneCellAndNoHalo) {
  const dpde_layout layout = make_layout(std::vector<int64_t>{128}, {1, 4, 4});
  EXPECT_EQ(layout.cells[1], 1);
  EXPECT_EQ(layout.halo[1], 0);
  EXPECT_EQ(cell_count(layout), 128);
  EXPECT_EQ(layout.size, 128 + 16 + 16);  // a cache line at both ends of the row, and of the field
}

TEST(Layout, RefusesWhatIsNoGrid) {
  const auto kind_of = [](const std::vector<int64_t>& cells, std::array<int64_t, 3> halo) {
    try {
      make_layout(cells, halo);
    } catch (const Error& error) {
      return error.kind() == ErrorKind::input ? "input" : "machine";
    }
    return "none";
  };
  EXPECT_STREQ(kind_of({}, {}), "input");
  EXPECT_STREQ(kind_of({1, 1, 1, 1}, {}), "input");
  EXPECT_STREQ(kind_of({0}, {}), "input");
  EXPECT_STREQ(kind_of({4, -3}, {}), "input");
  EXPECT_STREQ(kind_of({4}, {-1, 0, 0}), "input");
  EXPECT_STREQ(kind_of({std::numeric_limits<int64_t>::max()}, {}), "machine");
  EXPECT_STREQ(kind_of({1 << 20, 1 << 20, 1 << 20}, {}), "machine");
  EXPECT_STREQ(kind_of({4, 4, 4}, {1, int64_t{1} << 40, int64_t{1} << 40}), "machine");
  EXPECT_STREQ(kind_of({4}, {4, 0, 0}), "none");
  EXPECT_THROW(make_layout(std::vector<int64_t>{(1 << 24) + 1}, {}, DPDE_F32), Error);
  EXPECT_NO_THROW(make_layout(std::vector<int64_t>{1 << 24}, {}, DPDE_F32));
}

TEST(Field, CopiesDenseArraysAndKeepsTheHalo) {
  const dpde_layout layout = make_layout(std::vector<int64_t>{5, 3, 2}, {2, 1, 1});
  Field field(layout);
  field.fill(-1);
  std::vector<double> dense(30), back(30);
  for (size_t i = 0; i < 30; ++i) dense[i] = static_cast<double>(i);
  field.copy_in(dense);
  EXPECT_EQ(field.at(4, 2, 1), 29);
  EXPECT_EQ(field.at(1, 0, 0), 1);
  EXPECT_EQ(field.at(0, 1, 0), 5);
  EXPECT_EQ(field.at(0, 0, 1), 15);
  EXPECT_EQ(field.at(-1, 0, 0), -1);
  EXPECT_EQ(field.at(5, 3, 2), -1);
  field.copy_out(back);
  EXPECT_EQ(back, dense);
  EXPECT_THROW(field.copy_in(std::vector<double>(29)), Error);
}

TEST(Field, HoldsFloatsWhereTheLayoutSaysSo) {
  const dpde_layout layout = make_layout(std::vector<int64_t>{5, 3}, {1, 1, 0}, DPDE_F32);
  Field field(layout);
  std::vector<double> dense(15), back(15);
  for (size_t i = 0; i < dense.size(); ++i) dense[i] = 0.1 + static_cast<double>(i);
  field.copy_in(dense);
  field.copy_out(back);
  for (size_t i = 0; i < dense.size(); ++i) EXPECT_EQ(back[i], static_cast<float>(dense[i]));
  EXPECT_EQ(field.as<float>()[index_of(layout, 2, 1, 0)], 7.1f);
  field.set(0.3, 4, 2);
  EXPECT_EQ(field.at(4, 2), 0.3f);
  EXPECT_EQ(find_not_finite(layout, field.base()), std::nullopt);
  field.set(1e39, 3, 2);
  EXPECT_EQ(find_not_finite(layout, field.base()), (Cell{3, 2, 0}));
  EXPECT_EQ(value_at(layout, field.base(), {3, 2, 0}), std::numeric_limits<double>::infinity());
}

TEST(Field, AddsFloatsToDoubles) {
  const dpde_layout floats = make_layout(std::vector<int64_t>{5, 3}, {1, 1, 0}, DPDE_F32);
  const dpde_layout doubles = make_layout(std::vector<int64_t>{5, 3}, {2, 0, 0});
  Field part(floats), total(doubles), rounded(floats);
  part.fill(0.1);
  for (int i = 0; i < 3; ++i) add_interior(doubles, total.base(), {&floats, part.base()}, 2);
  EXPECT_EQ(total.at(4, 2), 3 * static_cast<double>(0.1f));
  EXPECT_EQ(total.at(-1, 0), 0);
  copy_interior(floats, rounded.base(), {&doubles, total.base()});
  EXPECT_EQ(rounded.at(4, 2), static_cast<float>(3 * static_cast<double>(0.1f)));
  EXPECT_EQ(rounded.at(-1, 0), 0);
}

TEST(Field, IsZeroAlignedAndStaggered) {
  const dpde_layout layout = make_layout(std::vector<int64_t>{1024, 4}, {1, 1, 0});
  const Field a(layout, 0), b(layout, 1);
  EXPECT_EQ(reinterpret_cast<uintptr_t>(a.base()) % 64, 0u);
  EXPECT_EQ(reinterpret_cast<uintptr_t>(b.base()) % 64, 0u);
  EXPECT_NE(reinterpret_cast<uintptr_t>(a.base()) % 4096, reinterpret_cast<uintptr_t>(b.base()) % 4096);
  EXPECT_EQ(a.at(-1, -1), 0);
  EXPECT_EQ(a.at(1024, 4), 0);
}

TEST(Field, SaysHowManyBytesThereAreNot) {
  const dpde_layout layout = make_layout(std::vector<int64_t>{1 << 14, 1 << 14, 1 << 14}, {1, 1, 1});
  try {
    Field field(layout);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::machine);
    EXPECT_NE(std::string(error.what()).find("bytes"), std::string::npos) << error.what();
  }
}

TEST(Field, Coordinates) {
  const dpde_layout layout = make_layout(std::vector<int64_t>{4, 3}, {2, 1, 0});
  Field x(layout), y(layout);
  fill_coordinate(x, 0, -1.0, 0.5, true);
  fill_coordinate(y, 1, 0.0, 2.0, false);
  EXPECT_EQ(x.at(0, 0), -0.75);
  EXPECT_EQ(x.at(3, 2), 0.75);
  EXPECT_EQ(x.at(-1, -1), 0.75);
  EXPECT_EQ(x.at(5, 1), -0.25);
  EXPECT_EQ(y.at(2, 0), 1);
  EXPECT_EQ(y.at(2, 2), 5);
  EXPECT_EQ(y.at(-2, -1), -1);
  EXPECT_EQ(y.at(5, 3), 7);
}

TEST(Field, FindsTheFirstValueThatIsNotFinite) {
  const dpde_layout layout = make_layout(std::vector<int64_t>{21, 3, 2}, {1, 1, 1});
  Field field(layout);
  field.fill(1e300);
  field.set(std::numeric_limits<double>::quiet_NaN(), -1, 0, 0);  // a ghost cell: ignored
  EXPECT_TRUE(is_finite(layout, field.base()));
  for (const double bad : {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN()}) {
    for (const Cell cell : {Cell{20, 2, 1}, Cell{9, 2, 1}, Cell{0, 1, 1}, Cell{16, 0, 0}}) {
      field.set(bad, cell.x, cell.y, cell.z);
      EXPECT_EQ(find_not_finite(layout, field.base()), cell);
    }
    field.fill(-2);
  }
}

}  // namespace
}  // namespace dpde
