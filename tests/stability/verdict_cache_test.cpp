// SPDX-License-Identifier: Apache-2.0
// Verdicts as text and back: nothing is lost, and what is not whole is none.
#include "stability/verdict_cache.h"

#include <gtest/gtest.h>

#include <limits>

namespace dpde::stability {
namespace {

Verdict any_verdict() {
  Verdict v;
  v.limit = {StepLimit::Kind::limit, 0.1, 2.5, {1, -2, 1e-300}, 3};
  v.is_of_walls = true;
  v.step = 1.0 / 3;
  v.parts = 4;
  v.growth = std::numeric_limits<double>::infinity();
  v.place = "x = 0.1, y = 2";
  v.field = "u.x";
  v.worst.fields["u.x"].value = std::numeric_limits<double>::quiet_NaN();
  v.worst.fields["u.x"].slope = {1, 2, 3};
  v.worst.params["cells.x"] = 16;
  v.courant = 0.5;
  return v;
}

TEST(VerdictCache, KeepsAllOfAVerdict) {
  const std::string text = text_of(any_verdict());
  const std::optional<Verdict> back = verdict_from(text);
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(text_of(*back), text);
  EXPECT_EQ(back->place, "x = 0.1, y = 2");
  EXPECT_EQ(back->step, 1.0 / 3);
  EXPECT_EQ(back->worst.params.at("cells.x"), 16);
  EXPECT_FALSE(verdict_from(text_of(Verdict{.why = "a network is in it"}))->is_analysed());
}

TEST(VerdictCache, TakesNothingThatIsNotWhole) {
  const std::string text = text_of(any_verdict());
  for (std::size_t length = 0; length < text.size(); ++length) EXPECT_FALSE(verdict_from(text.substr(0, length)));
  std::string other = text;
  other[text.find("0.3333")] = 'x';
  EXPECT_FALSE(verdict_from(other));
}

}  // namespace
}  // namespace dpde::stability
