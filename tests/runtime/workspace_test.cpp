// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/workspace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

namespace dpde::test {
namespace {

/// Released once. A holder keeps them, and all share the same ones as long as there is a holder.
TEST(Workspace, CoordinatesAreSharedAndMadeAgain) {
  Workspace workspace({.layout = make_layout(std::vector<int64_t>{6, 5}, {1, 1, 0}),
                       .axes = {{"x", 0, 0.5, true}, {"y", 1, 0.25, false}}});
  const std::vector<double> x = workspace.dense("x"), y = workspace.dense("y");
  ASSERT_EQ(x[3], 1.75);
  ASSERT_EQ(y[6], 1.375);
  const auto held = [&](const char* name) {
    const std::vector<BoundField> all = workspace.bound_fields();
    const auto found = std::ranges::find(all, name, &BoundField::name);
    return found == all.end() ? BoundField() : *found;
  };
  BoundField kept = held("x");
  ASSERT_NE(kept.base, nullptr);
  const std::weak_ptr<const void> of_y = held("y").keep;
  workspace.release_coordinates();
  EXPECT_TRUE(of_y.expired());
  EXPECT_EQ(held("x").base, kept.base);
  EXPECT_EQ(workspace.field("x").base(), kept.base);
  EXPECT_EQ(workspace.dense("y"), y);
  const void* const again = workspace.field("y").base();
  workspace.release_coordinates();
  EXPECT_EQ(workspace.field("y").base(), again) << "once";
  kept = {};
  EXPECT_EQ(workspace.dense("x"), x);
}

}  // namespace
}  // namespace dpde::test
