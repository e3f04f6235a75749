// SPDX-License-Identifier: Apache-2.0
// Vectors: one component an axis, under names of their own; what fits and what does not.
#include "model/model_support.h"

namespace dpde::model {
namespace {

/// The model m with vector u, field p and the vector coefficient w in a scene with as many axes.
std::string vector_text(const std::string& of_u, const std::string& of_p, int axes, const std::string& scene_lines = "",
                        const std::string& model_lines = "") {
  std::string text = "model m {\n  vector u\n  field p\n  coefficient vector w\n" + model_lines;
  text += "  dt(u) = " + of_u + "\n  dt(p) = " + of_p + "\n}\nscene s : m {\n";
  for (int axis = 0; axis < axes; ++axis) {
    text += std::string("  grid ") + "xyz"[axis] + " = 0 .. 1, cells 8, periodic\n";
  }
  return text + "  w = 0\n  initial p = 0\n  time 0 .. 1, step 1/8\n" +
         (scene_lines.empty() ? "  initial u = 0\n" : scene_lines) + "}\n";
}

/// The right-hand sides in the order of the states, each with the name of its state.
std::string equations(const std::string& of_u, const std::string& of_p, int axes, const std::string& model_lines = "") {
  std::string text;
  for (const State& state : problem_of(vector_text(of_u, of_p, axes, "", model_lines)).states) {
    text += state.name + ": " + print(*state.rhs) + "\n";
  }
  return text;
}

TEST(Vectors, HaveAComponentForEachAxis) {
  EXPECT_EQ(equations("-advect(u, u) - grad(p)", "-div(u)", 1), "u.x: -advect(u.x, u.x) - dx(p)\np: -dx(u.x)\n");
  EXPECT_EQ(equations("-advect(u, u) - grad(p)", "-div(u)", 2),
            "u.x: -advect((u.x, u.y), u.x) - dx(p)\nu.y: -advect((u.x, u.y), u.y) - dy(p)\n"
            "p: -(dx(u.x) + dy(u.y))\n");
  EXPECT_EQ(equations("lap(u)", "u.z*w.x", 3),
            "u.x: d(u.x, x, 2) + d(u.x, y, 2) + d(u.x, z, 2)\nu.y: d(u.y, x, 2) + d(u.y, y, 2) + d(u.y, z, 2)\n"
            "u.z: d(u.z, x, 2) + d(u.z, y, 2) + d(u.z, z, 2)\np: u.z*w.x\n");
}

TEST(Vectors, OfLetsAndTheirComponents) {
  EXPECT_EQ(equations("2*v", "v.y", 2, "  let v = u + w\n"), "u.x: 2*(u.x + w.x)\nu.y: 2*(u.y + w.y)\np: u.y + w.y\n");
}

TEST(Vectors, DotNormAndCurl) {
  EXPECT_EQ(equations("0", "dot(u, w)", 2), "u.x: 0\nu.y: 0\np: u.x*w.x + u.y*w.y\n");
  EXPECT_EQ(equations("curl(p)", "curl(u)", 2), "u.x: dy(p)\nu.y: -dx(p)\np: dx(u.y) - dy(u.x)\n");
  EXPECT_EQ(equations("curl(u)", "0", 3),
            "u.x: dy(u.z) - dz(u.y)\nu.y: dz(u.x) - dx(u.z)\nu.z: dx(u.y) - dy(u.x)\np: 0\n");
  EXPECT_EQ(equations("0", "bracket(p, u.x)", 2),
            "u.x: 0\nu.y: 0\np: (dx(p)*dy(u.x) - dy(p)*dx(u.x) + (dx(p*dy(u.x)) - dy(p*dx(u.x))) + (dy(u.x*dx(p)) - "
            "dx(u.x*dy(p))))/3\n");
  EXPECT_EQ(equations("0", "norm(u)", 1), "u.x: 0\np: if(u.x*u.x > 0, sqrt(if(u.x*u.x > 0, u.x*u.x, 1)), 0)\n");
}

TEST(Vectors, AreGivenWholeOrByComponent) {
  const Problem p = problem_of(vector_text("w", "0", 2, "  initial u.y = y\n  initial u.x = 2\n  exact u = (x, 0)\n"));
  EXPECT_EQ(print(*p.states[0].initial.formula), "2");
  EXPECT_EQ(print(*p.states[1].initial.formula), "y");
  EXPECT_EQ(print(*p.states[0].exact), "x");
  EXPECT_EQ(print(*p.states[1].exact), "0");
  const std::string by_component =
      "model m { vector u; dt(u.y) = 1; dt(u.x) = 2 }\nscene s : m {\n"
      "  grid x = 0 .. 1, cells 2, periodic\n  grid y = 0 .. 1, cells 2, periodic\n"
      "  initial u = (load(\"a.npy\"), 3)\n  time 0 .. 1, step 1\n}\n";
  const Problem q = problem_of(by_component);
  EXPECT_EQ(print(*q.states[0].rhs), "2");
  EXPECT_EQ(q.states[0].initial.file, "a.npy");
  EXPECT_EQ(print(*q.states[1].initial.formula), "3");
}

TEST(Vectors, HaveNamesThatNothingElseCanHave) {
  const std::string text =
      "model m { vector u; field u_x; dt(u) = (u_x, 0); dt(u_x) = u.x }\nscene s : m {\n"
      "  grid x = 0 .. 1, cells 2, periodic\n  grid y = 0 .. 1, cells 2, periodic\n"
      "  initial u = 0\n  initial u_x = 0\n  time 0 .. 1, step 1\n}\n";
  EXPECT_EQ(print(*problem_of(text).states[2].rhs), "u.x");
  EXPECT_EQ(message("model m { vector u; field u; dt(u) = 0 }\nscene s : m {\n  grid x = 0 .. 1, cells 2, periodic\n"
                    "  initial u = 0\n  time 0 .. 1, step 1\n}\n"),
            "u is given twice | ");
}

TEST(Vectors, HaveBoundariesOfTheirComponents) {
  const auto text = [](const std::string& boundary) {
    return "model m { vector u; param a; dt(u) = a*lap(u) }\nscene s : m {\n  grid x = 0 .. 1, cells 4\n"
           "  grid y = 0 .. 1, cells 4, periodic\n  a = 2\n  initial u = 0\n  time 0 .. 1, step 1\n  boundary " +
           boundary + "\n}\n";
  };
  const Problem p = problem_of(text("u: x.low = (a, 3), x.high = zero_gradient"));
  EXPECT_EQ(print(p.states[0].boundary[0].low.value), "a");
  EXPECT_EQ(print(p.states[1].boundary[0].low.value), "3");
  EXPECT_EQ(p.states[1].boundary[0].high.kind, SideKind::zero_gradient);
  EXPECT_EQ(problem_of(text("u = 0")).states[1].boundary[0].high.kind, SideKind::value);
  EXPECT_EQ(problem_of(text("u.x = 0; boundary u.y = 1")).states.size(), 2u);
  EXPECT_EQ(message(text("u = a")),
            "expected 2 components but this has 1 | write (a, b), or boundary u.x: ... for one component");
  EXPECT_EQ(message(text("u = 0; boundary u.x = 1")), "the boundary of u.x at x.low is given twice | ");
}

TEST(Vectors, InTasks) {
  const std::string scene = vector_text("-u", "0", 2);
  const Problem p = problem_of(scene +
                               "task t : s {\n  data v = u from scene s\n"
                               "  data f = (load(\"a.npy\"), load(\"b.npy\"))\n  unknown initial u from (1, x)\n"
                               "  minimise mean(dot(u - v, u - f))\n}\n");
  ASSERT_EQ(p.task->data.size(), 4u);
  EXPECT_EQ(p.task->data[1].name, "v.y");
  EXPECT_EQ(p.task->data[1].field, "u.y");
  EXPECT_EQ(p.task->data[3].file, "b.npy");
  ASSERT_EQ(p.task->unknowns.size(), 2u);
  EXPECT_EQ(p.task->unknowns[1].name, "u.y");
  EXPECT_EQ(print(*p.task->unknowns[1].from.formula), "x");
  EXPECT_EQ(print(p.task->losses[0].value), "mean((u.x - v.x)*(u.x - f.x) + (u.y - v.y)*(u.y - f.y))");
  EXPECT_EQ(message(scene + "task t : s {\n  unknown initial u\n  unknown initial u.x\n  minimise mean(p)\n}\n"),
            "unknown u.x is given twice | ");
}

/// A product of vectors whose components lie on faces lies at the centres, on one axis and with one term, too.
TEST(Vectors, OnFacesHaveTheirProductAtTheCentres) {
  const auto rate_of_h = [](const std::string& product, const std::string& more_axes) {
    const Problem problem = problem_of("model m { vector v on faces; field h; dt(v) = 0*v; dt(h) = " + product +
                                       " }\nscene s : m { grid x = 0 .. 1, cells 8, periodic\n" + more_axes +
                                       "initial v = 0; initial h = 0; time 0 .. 1, step 1/8 }\n");
    return print(*problem.find_state("h")->rhs);
  };
  EXPECT_EQ(rate_of_h("dot(v, v)", ""), "interpolate(v.x*v.x)");
  EXPECT_EQ(rate_of_h("dot(v, (1, 0))", "grid y = 0 .. 1, cells 8, periodic\n"), "interpolate(v.x)");
}

/// On the faces of a pole nothing flows, whatever flows there.
TEST(Vectors, OnFacesCarryNumbersOverPolesAsFluxes) {
  const auto refusal = [](const std::string& rate, const std::string& low) {
    const bool has_pole = low == "0";
    const std::string across = has_pole ? "pole" : "0";
    return refusal_of(
        "model m { vector v on faces; field f; vector w; dt(v) = 0*v; dt(w) = 0*w; dt(f) = " + rate +
        " }\nscene s : m {\n  coordinates polar\n  grid r = " + low +
        " .. 2, cells 4\n  grid theta = 0 .. 2*pi, cells 8, periodic\n"
        "  boundary v.x: r = 0\n  boundary v.y: r.low = " +
        across + ", r.high = 0\n  boundary f: r.low = " + across + ", r.high = 0\n  boundary w: r.low = " + across +
        ", r.high = 0\n  initial v = (0, 0)\n  initial w = (0, 0)\n  initial f = r^2\n  time 0 .. 1, step 0.1\n}\n");
  };
  EXPECT_NE(refusal("-advect(v, f)", "0").find("E0440 write div(v*interpolate(f))"), std::string::npos);
  EXPECT_EQ(refusal("-div(v*interpolate(f))", "0"), "");
  EXPECT_EQ(refusal("-advect(v, f)", "1"), "");
  EXPECT_NE(refusal("-advect(v, w).x", "0").find("E0440"), std::string::npos);
  EXPECT_EQ(refusal("-advect(v, w).x", "1"), "");
}

/// Of derivatives of derivatives beside a pole a factor leaves nothing that falls faster than lengths do.
TEST(Vectors, DerivativesOfDerivativesAreRightBehindAFactorThatFallsTowardsPoles) {
  const auto warning = [](const std::string& factor) {
    return message("model m { vector u on faces; dt(u) = -curl(" + factor +
                   "*curl(u)) }\nscene s : m {\n  coordinates sphere(1)\n  grid lon = 0 .. 2*pi, cells 8, periodic\n"
                   "  grid lat = -pi/2 .. pi/2, cells 4\n  boundary u.x: lat = pole\n  boundary u.y: lat = 0\n"
                   "  initial u = (cos(lat), 0)\n  time 0 .. 0.01, step 0.001\n}\n");
  };
  EXPECT_NE(warning("2").find("next to a pole"), std::string::npos);
  EXPECT_NE(warning("cos(lat)").find("next to a pole"), std::string::npos);
  EXPECT_EQ(warning("min(1, 25*cos(lat)^2)"), "0 diagnostics:");
}

}  // namespace
}  // namespace dpde::model
