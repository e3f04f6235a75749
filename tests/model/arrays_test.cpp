// SPDX-License-Identifier: Apache-2.0
// Arrays of species: written by hand they are the same model.
#include <fstream>
#include <sstream>

#include "model/model_support.h"
#include "model/print/print_model.h"

namespace dpde::model {
namespace {

const std::string by_index = R"(
model food {
  field c[3], s
  param D[3] = (1, 2, 3), A[3, 3], g
  coefficient k[3]
  let r[i] = g*(1 - c[i])
  dt(c[i]) = D[i]*lap(c[i]) + k[i]*r[i]*sum(A[i, j]*c[j], j)
  dt(s) = c[1] - s*c[3]
}
scene pond : food {
  grid x = 0 .. 1, cells 8
  g = 4
  A = ((7, -1, 5), (2, 9, -3), (-4, 6, 8))
  k = x; initial s = 0
  boundary c = 0; boundary c[3]: x.high = 5
  boundary s = 0
  initial c[i] = sin(i*x)
  time 0 .. 1, step 1/8
  observe total = sum(integral(c[i]), over = i)
  observe gauge[i] = sample(c[i], at = i/4)
  every 1/4: c[i] += 2*i
  output c, s every 1/2
}
)";

const std::string by_hand = R"(
model food {
  field c_1, c_2, c_3, s
  param D_1 = 1, D_2 = 2, D_3 = 3, A_1_1, A_1_2, A_1_3, A_2_1, A_2_2, A_2_3, A_3_1, A_3_2, A_3_3, g
  coefficient k_1, k_2, k_3
  dt(c_1) = D_1*lap(c_1) + k_1*(g*(1 - c_1))*(A_1_1*c_1 + A_1_2*c_2 + A_1_3*c_3)
  dt(c_2) = D_2*lap(c_2) + k_2*(g*(1 - c_2))*(A_2_1*c_1 + A_2_2*c_2 + A_2_3*c_3)
  dt(c_3) = D_3*lap(c_3) + k_3*(g*(1 - c_3))*(A_3_1*c_1 + A_3_2*c_2 + A_3_3*c_3)
  dt(s) = c_1 - s*c_3
}
scene pond : food {
  grid x = 0 .. 1, cells 8
  g = 4
  A_1_1 = 7; A_1_2 = -1; A_1_3 = 5; A_2_1 = 2; A_2_2 = 9; A_2_3 = -3; A_3_1 = -4; A_3_2 = 6; A_3_3 = 8
  k_1 = x; k_2 = x; k_3 = x; initial s = 0
  boundary c_1 = 0; boundary c_2 = 0; boundary c_3: x.low = 0, x.high = 5
  boundary s = 0
  initial c_1 = sin(1*x); initial c_2 = sin(2*x); initial c_3 = sin(3*x)
  time 0 .. 1, step 1/8
  observe total = integral(c_1) + integral(c_2) + integral(c_3)
  observe gauge_1 = sample(c_1, at = 1/4)
  observe gauge_2 = sample(c_2, at = 2/4)
  observe gauge_3 = sample(c_3, at = 3/4)
  every 1/4: c_1 += 2*1, c_2 += 2*2, c_3 += 2*3
  output c_1, c_2, c_3, s every 1/2
}
)";

TEST(Arrays, AreTheirElements) {
  std::string one_by_one = by_index;
  const std::string both = "boundary c = 0; boundary c[3]: x.high = 5";
  one_by_one.replace(one_by_one.find(both), both.size(),
                     "boundary c[1] = 0; boundary c[2] = 0; boundary c[3]: x.low = 0, x.high = 5");
  EXPECT_EQ(print(problem_of(one_by_one)), print(problem_of(by_hand)));
}

TEST(Arrays, StandInDerivedScenesAndTasks) {
  const std::string more = R"(
scene other = pond { initial c[2] = 3; D[1] = 9; A = 0; boundary c[3]: x.high = 5 }
task find : pond {
  data d[i] = c[i] from scene other at t = 1
  unknown D
  unknown A[1, 2] from 1/2
  unknown initial c[i]
  minimise mean(sum((c[i] - d[i])^2, i))
}
)";
  const auto changed = [&](std::string text) {
    const std::string both = "boundary c = 0; boundary c[3]: x.high = 5";
    text.replace(text.find(both), both.size(), "boundary c = 0");
    return text + more;
  };
  const Problem other = problem_of(changed(by_index), {"other", {}, ""});
  EXPECT_EQ(other.find_param("D_1")->value, 9);
  EXPECT_EQ(other.find_param("D_2")->value, 2);
  EXPECT_EQ(other.find_param("A_3_2")->value, 0);
  EXPECT_EQ(print(*other.find_state("c_2")->initial.formula), "3");
  EXPECT_EQ(print(*other.find_state("c_3")->initial.formula), "sin(3*x)");
  EXPECT_EQ(print(other.find_state("c_3")->boundary[0].high.value), "5");
  const Problem find = problem_of(changed(by_index), {"find", {}, ""});
  EXPECT_EQ(find.task->unknowns.size(), 7U);
  EXPECT_EQ(print(find.task->losses[0].value), "mean((c_1 - d_1)^2 + (c_2 - d_2)^2 + (c_3 - d_3)^2)");
}

TEST(Arrays, StandInTimesRowsOfSchemesAndLetsOfOtherScenes) {
  const std::string by_index = R"(
model m { field c[2]; param T[2]; dt(c[i]) = -i*advect(0.5, c[i]) }
scheme one { advect = upwind(1); advect c[2] = central(2) }
scene s : m with one {
  grid x = 0 .. 1, cells 8, periodic
  T = (1/4, 1/2)
  let w[i] = i*T[i]
  initial c[i] = w[i]*sin(2*pi*x)
  time 0 .. 1, step 1/8
  every T[1]: c[1] += 1
  at t = T[2]: c[2] += 1
  output c every T[1]
}
scene s2 = s { initial c[i] = 2*w[i] }
task find : s2 {
  unknown T[1]
  minimise mean((sum(c[i], i) - sum(w[i], i))^2) at t = T[2]
}
)";
  std::string by_hand = by_index;
  const auto replace = [&](const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = by_hand.find(from, at)) != std::string::npos; at += to.size())
      by_hand.replace(at, from.size(), to);
  };
  replace("field c[2]; param T[2]; dt(c[i]) = -i*advect(0.5, c[i])",
          "field c_1, c_2; param T_1, T_2; dt(c_1) = -1*advect(0.5, c_1); dt(c_2) = -2*advect(0.5, c_2)");
  replace("let w[i] = i*T[i]", "let w_1 = 1*T_1; let w_2 = 2*T_2");
  replace("initial c[i] = w[i]*sin(2*pi*x)", "initial c_1 = w_1*sin(2*pi*x); initial c_2 = w_2*sin(2*pi*x)");
  replace("initial c[i] = 2*w[i]", "initial c_1 = 2*w_1; initial c_2 = 2*w_2");
  replace("sum(c[i], i) - sum(w[i], i)", "c_1 + c_2 - (w_1 + w_2)");
  replace("T = (1/4, 1/2)", "T_1 = 1/4; T_2 = 1/2");
  replace("output c", "output c_1, c_2");
  replace("[1]", "_1");
  replace("[2]", "_2");
  for (const char* name : {"s", "s2"})
    EXPECT_EQ(print(problem_of(by_index, {name, {}, ""})), print(problem_of(by_hand, {name, {}, ""})));
  const auto refusal = [](const std::string& text) {
    const Outcome outcome = outcome_of(text, {"find", {}, ""});
    return outcome.diagnostics.empty() ? "" : outcome.diagnostics.front().message;
  };
  EXPECT_EQ(refusal(by_index), refusal(by_hand));
  std::string whole = by_index;
  whole.replace(whole.find("advect = upwind(1); advect c[2]"), 31, "advect c[1] = upwind(1); advect c");
  EXPECT_NE(refusal(whole).find("given twice"), std::string::npos) << refusal(whole);
}

TEST(Arrays, TuplesGiveEachElementItsOwn) {
  const Problem problem = problem_of(
      "model m { field c[3]; param A[2, 3] = 0\ndt(c[i]) = -A[1, i]*c[i] + A[2, i] }\n"
      "scene s : m { grid x = 0 .. 1, cells 8, periodic\n"
      "initial c = (1, 2, 3); A = ((1, 2, 3), (4, 5, 6))\ntime 0 .. 1, step 1/8 }\n");
  EXPECT_EQ(print(*problem.find_state("c_2")->initial.formula), "2");
}

TEST(Arrays, TuplesGiveEachItsOwnAtWallsAndInEvents) {
  const Problem problem = problem_of(
      "model m { field c[2]; dt(c[i]) = lap(c[i]) }\nscene s : m { grid x = 0 .. 1, cells 8\n"
      "boundary c: x.low = (3, 4), x.high = zero_gradient; initial c = 0\n"
      "after step: c = (c[2], c[1])\ntime 0 .. 1, step 1/8 }\n");
  EXPECT_EQ(print(problem.find_state("c_1")->boundary[0].low.value), "3");
  EXPECT_EQ(print(problem.find_state("c_2")->boundary[0].low.value), "4");
  ASSERT_EQ(problem.events.front().updates.size(), 2U);
  EXPECT_EQ(print(problem.events.front().updates[0].value), "c_2");
  EXPECT_EQ(print(problem.events.front().updates[1].value), "c_1");
}

}  // namespace
}  // namespace dpde::model
