// SPDX-License-Identifier: Apache-2.0
// A new kind of item has to be put into a list, and then into a case of each analysis of what stands there.
#include "syntax/item_kinds.h"

#include <gtest/gtest.h>

namespace dpde::ast {
namespace {

template <class Kind>
constexpr int lists_of = InKernels<Kind> + InPrograms<Kind> + InModels<Kind> + Elsewhere<Kind>;

template <class... Kinds>
constexpr bool are_in_one_list(const Variant<Kinds...>*) {
  return ((lists_of<Kinds> == 1) && ...);
}

struct NewItem {};

TEST(ItemKinds, AreInOneListEach) {
  EXPECT_TRUE(are_in_one_list(static_cast<const ItemKind*>(nullptr)));
  EXPECT_EQ(lists_of<NewItem>, 0);
  EXPECT_FALSE(OutsidePrograms<NewItem> || OutsideKernels<NewItem> || OutsideModels<NewItem>) << "no case takes it";
}

}  // namespace
}  // namespace dpde::ast
