// SPDX-License-Identifier: Apache-2.0
// Several models in one scene.
#include "model/model_support.h"

namespace dpde::model {
namespace {

const std::string models = R"(model flow { vector u; param nu; dt(u) = -advect(u, u) + nu*lap(u) }
model tracer { field c; coefficient vector u; coefficient w; dt(c) = -advect(u, c) + w }
model heat { field c; param k; dt(c) = k*lap(c) }
model numbers { field q; coefficient u; dt(q) = u }
)";

std::string scene_of(const std::string& of, const std::string& lines) {
  return models + "scene s : " + of +
         " {\n  grid x = 0 .. 1, cells 4, periodic\n  grid y = 0 .. 1, cells 4, periodic\n" + lines +
         "\n  time 0 .. 1, step 1/8\n}\n";
}

TEST(Coupling, GivesTheFieldOfOneModelToTheOther) {
  const Problem p = problem_of(scene_of("flow, tracer", "nu = 2; w = x; initial u = 0; initial c = 1"));
  EXPECT_EQ(p.model, "flow, tracer");
  ASSERT_EQ(p.states.size(), 3u);
  EXPECT_EQ(print(*p.states[2].rhs), "-advect((u.x, u.y), c) + w");
  ASSERT_EQ(p.coefficients.size(), 1u);
  EXPECT_EQ(p.coefficients[0].name, "w");
  const Problem other_order = problem_of(scene_of("tracer, flow", "nu = 2; w = x; initial u = 0; initial c = 1"));
  EXPECT_EQ(print(*other_order.states[0].rhs), "-advect((u.x, u.y), c) + w");
}

// A mask of land that the air and the ground read is one field.
TEST(Coupling, SharesCoefficients) {
  const std::string land =
      "model air { field c; coefficient land; dt(c) = -land*c }\n"
      "model ground { field T; coefficient land; dt(T) = -land*T }\n"
      "model faces { field q; coefficient land on faces.x; dt(q) = -interpolate(land)*q }\n";
  const Problem p = problem_of(land + scene_of("air, ground", "land = x; initial c = 1; initial T = 2"));
  ASSERT_EQ(p.coefficients.size(), 1u);
  EXPECT_EQ(print(*p.states[1].rhs), "-land*T");
  EXPECT_EQ(message(land + scene_of("air, faces", "land = x; initial c = 1; initial q = 2")), "land is given twice | ");
}

TEST(Coupling, InDataOfATask) {
  const Problem p =
      problem_of(scene_of("flow, tracer", "nu = 2; w = x; initial u = 0; initial c = 1") +
                 "task t : s {\n  data v = u from scene s\n  unknown initial u\n  minimise mean(dot(u - v, u))\n}\n");
  EXPECT_EQ(p.task->data.size(), 2u);
}

}  // namespace
}  // namespace dpde::model
