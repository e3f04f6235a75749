// SPDX-License-Identifier: Apache-2.0
// What constraints and masks do not go with: each would otherwise be a wrong step without a word.
#include "model/model_support.h"

namespace dpde::model {
namespace {

std::string flow(const std::string& model_lines, const std::string& sides = "boundary u: x = 0") {
  return "model m {\n  vector u on faces\n  field p\n  field T\n  mask solid\n"
         "  dt(u) = lap(u) - grad(p)\n  dt(T) = lap(T)\n" +
         model_lines +
         "}\nscene s : m {\n  grid x = 0 .. 1, cells 8\n  grid y = 0 .. 1, cells 8, periodic\n"
         "  solid = x < 0.3\n  initial u = 0\n  initial T = 0\n  boundary T: x = 0\n  time 0 .. 1, step 1/8\n  " +
         sides + "\n}\n";
}
const std::string constraint = "  0 = div(u) gives p\n", held = "  T = 1 inside solid\n";
const std::string heat =
    "model m {\n  field T\n  mask solid\n  dt(T) = lap(T)\n  T = 1 inside solid\n}\nscene s : m {\n"
    "  grid x = 0 .. 1, cells 8, periodic\n  solid = x < 0.3\n  initial T = 0\n  time 0 .. 1, step 1/8\n";

TEST(Projections, GoWithSchemesOfStages) {
  for (const char* time : {"euler", "rk2", "rk4", "ssp_rk3", "ab2", "ab3", "imex_euler", "ars222"}) {
    EXPECT_EQ(refusal_of(flow(constraint + held), {{"time", time}}), "") << time;
    EXPECT_EQ(refusal_of(heat + "}\n", {{"time", time}}), "") << time;
  }
  for (const char* time : {"leapfrog", "etdrk2", "verlet"}) {
    const std::string refusal = " does not go with a mask: E0555 take time = rk4, ssp_rk3 or ab2";
    EXPECT_EQ(refusal_of(heat + "}\n", {{"time", time}}).find(std::string("time = ") + time + refusal), 0u) << time;
  }
  for (const char* advect : {"semi_lagrangian", "semi_lagrangian_cubic", "maccormack"})
    EXPECT_EQ(refusal_of(flow(constraint + held), {{"advect", advect}}), "") << advect;
}

/// Velocities at the centres: by waves alone.
TEST(Projections, AtCentresAreOfWaves) {
  const auto refusal = [](const std::string& rates, const std::pair<const std::string, std::string>& dx) {
    return refusal_of("model m {\n  vector u\n  field p\n  mask solid\n  param k\n  let r = 1 + k*sin(2*pi*x)\n" +
                          rates +
                          "  0 = div(u) gives p\n}\nscene s : m {\n  grid x = 0 .. 1, cells 8, periodic\n"
                          "  k = 0.1; solid = x < 0.3\n  initial u = 0\n  time 0 .. 1, step 1/8\n}\n",
                      {dx});
  };
  EXPECT_EQ(refusal("  dt(u) = -grad(p)\n", {"dx", "spectral"}), "");
  EXPECT_EQ(refusal("  dt(u) = -grad(p)/k\n", {"dx", "spectral"}), "");
}

TEST(Projections, OfEachStep) {
  const std::string each_step = "  0 = div(u) gives p each step\n", each_stage = "  0 = div(u) gives p each stage\n";
  for (const char* time : {"euler", "rk2", "rk4", "ssp_rk3", "bs32", "dopri5", "ab2", "imex_euler", "ars443"})
    EXPECT_EQ(refusal_of(flow(each_step + held), {{"time", time}}), "") << time;
  for (const char* advect : {"semi_lagrangian", "maccormack"}) {
    EXPECT_EQ(refusal_of(flow(each_step), {{"advect", advect}}), "") << advect;
  }
  EXPECT_EQ(refusal_of(flow(each_stage), {{"time", "dopri5"}, {"tolerance", "1e-6"}}), "");
  EXPECT_EQ(refusal_of(flow("  0 = div(u) gives p each stage from T\n"), {{"solve", "cg"}}), "");
}

TEST(Projections, OfStarts) {
  const auto with = [](const std::string& u, const std::string& t) {
    std::string text = flow(constraint);
    text.replace(text.find("initial u = 0"), 13, "initial u = " + u);
    text.replace(text.find("initial T = 0"), 13, "initial T = " + t);
    return refusal_of(text);
  };
  EXPECT_EQ(with("(y, x) projected", "0"), "");
  std::string seeks = flow("  field q\n  param a\n  coefficient k\n  dt(q) = k*q\n" + constraint,
                           "boundary u: x = 0\n  boundary q: x = 0\n  initial q = x\n  a = 2; k = a*x");
  seeks.replace(seeks.find("initial u = 0"), 13, "initial u = (y, x) projected");
  EXPECT_EQ(refusal_of(seeks), "");
}

}  // namespace
}  // namespace dpde::model
