// SPDX-License-Identifier: Apache-2.0
// Walks over statements: each is met once, before those of its blocks, and blocks that a walk does not go into are
// left.
#include "stencil/walk.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace dpde::stencil {
namespace {

using Names = std::vector<std::string>;

/// Runs a, then b in a repeat, then c in the operator of a solve, then d.
std::vector<Statement> nested() {
  Repeat repeat;
  repeat.body = {stencil::Run{"b"}};
  Solve solve;
  solve.body = {stencil::Run{"c"}};
  return {stencil::Run{"a"}, repeat, solve, stencil::Run{"d"}};
}

Names kernels_met(const std::vector<Statement>& body, Blocks blocks) {
  Names names;
  for_each_kind<stencil::Run>(
      body, [&](const stencil::Run& run) { names.push_back(run.kernel); }, blocks);
  return names;
}

TEST(Walk, MeetsEachStatementOnceBeforeThoseOfItsBlocks) {
  const std::vector<Statement> body = nested();
  EXPECT_EQ(kernels_met(body, Blocks::all), (Names{"a", "b", "c", "d"}));
  EXPECT_EQ(kernels_met(body, Blocks::passes), (Names{"a", "b", "d"}));  // an operator is a program of its own
  std::string order;
  for_each_statement(body, [&](const Statement& statement) {
    match_some(
        statement, [&](const stencil::Run& run) { order += run.kernel; }, [&](const Repeat&) { order += '2'; },
        [&](const Solve&) { order += '='; });
  });
  EXPECT_EQ(order, "a2b=cd");
}

TEST(Walk, FindsTheFirstOfAKind) {
  const std::vector<Statement> body = nested();
  const auto any = [](const auto&) { return true; };
  EXPECT_EQ(find_kind<stencil::Run>(body, any), &std::get<stencil::Run>(body[0]));
  EXPECT_EQ(find_kind<Solve>(body, any), &std::get<Solve>(body[2]));
  EXPECT_EQ(find_kind<Reduce>(body, any), nullptr);
  const stencil::Run& inside = std::get<stencil::Run>(std::get<Solve>(body[2]).body[0]);
  const auto is_inside = [&](const stencil::Run& run) { return &run == &inside; };
  EXPECT_EQ(find_kind<stencil::Run>(body, is_inside), &inside);
  EXPECT_EQ(find_kind<stencil::Run>(body, is_inside, Blocks::passes), nullptr);
}

/// A run becomes two, or none; all else is as it was, blocks and order.
TEST(Walk, ReplacesAndErases) {
  const std::vector<Statement> body = nested();
  const auto twice = [](const stencil::Run& run) { return std::vector<Statement>{run, run}; };
  const std::vector<Statement> doubled = replace_kind<stencil::Run>(body, twice);
  EXPECT_EQ(kernels_met(doubled, Blocks::all), (Names{"a", "a", "b", "b", "c", "c", "d", "d"}));
  EXPECT_EQ(replace_kind<stencil::Run>(body, [](const stencil::Run& run) { return std::vector<Statement>{run}; }),
            body);
  std::vector<Statement> without = body;
  const auto is_run = [](const Statement& statement) { return is_one_of<stencil::Run>(statement); };
  erase_statements(without, is_run, Blocks::passes);
  EXPECT_EQ(kernels_met(without, Blocks::all), Names{"c"});
  erase_statements(without, is_run);
  EXPECT_EQ(kernels_met(without, Blocks::all), Names{});
  EXPECT_EQ(without.size(), 2U);
}

TEST(Walk, ChangesWhatMayBeChanged) {
  std::vector<Statement> body = nested();
  for_each_kind<stencil::Run>(body, [](stencil::Run& run) { run.kernel += "_2"; });
  EXPECT_EQ(kernels_met(body, Blocks::all), (Names{"a_2", "b_2", "c_2", "d_2"}));
}

/// Which is a block, as the operator is.
TEST(Walk, GoesIntoTheStepOfNewtonsMethod) {
  Solve solve;
  solve.is_linear = false;
  solve.body = {stencil::Run{"operator"}};
  solve.step = {stencil::Run{"step"}};
  const std::vector<Statement> body{solve};
  EXPECT_EQ(kernels_met(body, Blocks::all), (Names{"operator", "step"}));
  EXPECT_EQ(kernels_met(body, Blocks::passes), Names{});
}

}  // namespace
}  // namespace dpde::stencil
