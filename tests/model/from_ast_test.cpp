// SPDX-License-Identifier: Apache-2.0
// Whole problems: the sketches of the language, their numbers and their printed text.
#include <cmath>

#include "model/model_support.h"
#include "support/names/bound_names.h"

namespace dpde::model {
namespace {

constexpr double pi = 3.14159265358979323846;

const std::string burgers = R"(
model burgers {
  field u
  param nu
  dt(u) = -advect(u, u) + nu*lap(u)
}
scheme cheap   { advect = semi_lagrangian; lap = central(2); time = euler; real = f64 }
scheme precise { advect = upwind(1); dx = central(4); lap = central(4); time = rk4 }
scene wave : burgers {
  grid x = -1 .. 1, cells 128, periodic
  nu = 0.01/pi
  initial u = -sin(pi*x)
  time 0 .. 1, step 1/32
}
task recover : wave with cheap {
  data     u_ref = load("burgers_t05.npy")
  unknown  initial u from 0
  minimise mean((u - u_ref)^2) at t = 0.5
  using    gradient_descent(rate = 5), iterations 50
}
)";

TEST(Sketch, BurgersWave) {
  const Problem p = problem_of(burgers, {"wave", {}, ""});
  EXPECT_EQ(p.scene, "wave");
  EXPECT_EQ(p.model, "burgers");
  ASSERT_EQ(p.axes.size(), 1u);
  EXPECT_EQ(p.axes[0].name, "x");
  EXPECT_EQ(p.axes[0].low, -1);
  EXPECT_EQ(p.axes[0].high, 1);
  EXPECT_EQ(p.axes[0].cells, 128);
  EXPECT_EQ(p.axes[0].topology, Topology::periodic);
  EXPECT_DOUBLE_EQ(p.axes[0].spacing(), 1.0 / 64);
  ASSERT_EQ(p.params.size(), 1u);
  EXPECT_DOUBLE_EQ(p.params[0].value, 0.01 / pi);
  EXPECT_EQ(p.steps, 32);
  EXPECT_EQ(p.step, 0.03125);
  EXPECT_EQ(p.t_begin, 0);
  EXPECT_FALSE(p.task.has_value());
  EXPECT_NE(p.find_state("u"), nullptr);
  EXPECT_EQ(p.find_state("v"), nullptr);
}

TEST(Sketch, BurgersRecover) {
  const Problem p = problem_of(burgers);
  ASSERT_TRUE(p.task.has_value());
  const Task& task = *p.task;
  EXPECT_EQ(task.name, "recover");
  ASSERT_EQ(task.data.size(), 1u);
  EXPECT_EQ(task.data[0].file, "burgers_t05.npy");
  EXPECT_TRUE(task.data[0].scene.empty());
  ASSERT_EQ(task.unknowns.size(), 1u);
  EXPECT_EQ(task.unknowns[0].kind, Unknown::Kind::initial);
  EXPECT_EQ(*task.unknowns[0].from.formula, Expr(0.0));
  ASSERT_EQ(task.losses.size(), 1u);
  EXPECT_EQ(print(task.losses[0].value), "mean((u - u_ref)^2)");
  EXPECT_EQ(task.losses[0].when.kind, When::Kind::at);
  EXPECT_EQ(task.losses[0].when.times, std::vector<double>{0.5});
  ASSERT_TRUE(task.optimiser.has_value());
  EXPECT_EQ(task.optimiser->kind, Optimiser::Kind::gradient_descent);
  EXPECT_EQ(task.optimiser->rate, 5);
  EXPECT_EQ(task.optimiser->iterations, 50);
  EXPECT_EQ(p.scheme.transport.advect, Advection::semi_lagrangian);
  EXPECT_EQ(p.scheme.time, time_method("euler"));
  EXPECT_EQ(print(*p.states[0].initial.formula), "-sin(pi*x)");  // the scene's own stays, for data of the same scene
}

TEST(Sketch, BurgersText) {
  EXPECT_EQ(print(problem_of(burgers)), R"(scene wave : burgers with cheap {
  grid x = -1 .. 1, cells 128, periodic
  nu = 0.003183098861837907
  dt(u) = -advect(u, u) + nu*d(u, x, 2)
  initial u = -sin(pi*x)
  time 0 .. 1, step 0.03125  # 32 steps
}

scheme cheap { advect = semi_lagrangian; dx = central(2); lap = central(2); time = euler }

task recover : wave {
  data u_ref = load("burgers_t05.npy")
  unknown initial u from 0
  minimise mean((u - u_ref)^2) at t = 0.5
  using gradient_descent(rate = 5), iterations 50
}
)");
}

const std::string gray_scott = R"(
model gray_scott {
  field a
  field b
  param Da, Db, k, F
  dt(a) = Da*lap(a) - a*b^2 + F*(1 - a)
  dt(b) = Db*lap(b) + a*b^2 - (F + k)*b
}
scene spots : gray_scott {
  grid y = 0 .. 2, cells 32
  grid x = 0 .. L, cells 2*32, periodic
  boundary a: y = zero_gradient
  boundary b: y.low = zero_gradient, y.high = Db
  Da = 2e-5; Db = Da/2; F = 0.04; k = 0.06
  initial a = 1 - 0.5*exp(-100*((x - 1)^2 + (y - 1)^2))
  initial b = load("b.npy")
  observe mass = mean(a) + mean(b)
  time 0 .. 10, step 1
}
)";

TEST(Sketch, GrayScottText) {
  std::string text = gray_scott;
  text.replace(text.find("0 .. L"), 6, "0 .. 1 + 1");
  EXPECT_EQ(print(problem_of(text)), R"(scene spots : gray_scott with default {
  grid x = 0 .. 2, cells 64, periodic
  grid y = 0 .. 2, cells 32
  Da = 2e-05
  Db = 1e-05
  k = 0.06
  F = 0.04
  dt(a) = Da*(d(a, x, 2) + d(a, y, 2)) - a*b^2 + F*(1 - a)
  dt(b) = Db*(d(b, x, 2) + d(b, y, 2)) + a*b^2 - (F + k)*b
  boundary a: y.low zero_gradient, y.high zero_gradient
  boundary b: y.low zero_gradient, y.high = Db
  initial a = 1 - 0.5*exp(-100*((x - 1)^2 + (y - 1)^2))
  initial b = load("b.npy")
  observe mass = mean(a) + mean(b)
  time 0 .. 10, step 1  # 10 steps
}

scheme default { advect = central(2); dx = central(2); lap = central(2); time = rk4 }
)");
}

TEST(Sketch, GrayScottWithAName) {
  const Outcome outcome = outcome_of(gray_scott);
  EXPECT_EQ(outcome.code_and_hint(), "E0301 known here: Da, Db, F, a, b, k, pi, t, x, y, z");
}

TEST(Heat, OneModelOnOneTwoAndThreeAxes) {
  const std::string model = "model heat { field u; param kappa; dt(u) = kappa*lap(u) }\n";
  const std::vector<std::string> expected{"kappa*d(u, x, 2)", "kappa*(d(u, x, 2) + d(u, y, 2))",
                                          "kappa*(d(u, x, 2) + d(u, y, 2) + d(u, z, 2))"};
  for (int axes = 1; axes <= 3; ++axes) {
    std::string scene = "scene s : heat {\n";
    for (int axis = 0; axis < axes; ++axis) scene += std::string("grid ") + "xyz"[axis] + " = 0 .. 2*pi, cells 16\n";
    scene +=
        "boundary u: all = zero_gradient\nkappa = 0.5\ninitial u = sin(x)\nexact u = exp(-kappa*t)*sin(x)\ntime 1 .. "
        "1.5, step 0.1\n}";
    const Problem p = problem_of(model + scene);
    EXPECT_EQ(print(*p.states[0].rhs), expected[axes - 1]);
    EXPECT_EQ(p.axes.size(), static_cast<std::size_t>(axes));
    EXPECT_EQ(p.axes.back().topology, Topology::bounded);
    EXPECT_DOUBLE_EQ(p.axes.back().high, 2 * pi);
    ASSERT_EQ(p.states[0].boundary.size(), static_cast<std::size_t>(axes));
    for (const AxisSides& sides : p.states[0].boundary) {
      EXPECT_EQ(sides.low.kind, SideKind::zero_gradient);
      EXPECT_EQ(sides.high.kind, SideKind::zero_gradient);
    }
    EXPECT_EQ(p.steps, 5);
    EXPECT_EQ(p.t_begin, 1);
    EXPECT_EQ(print(*p.states[0].exact), "exp(-kappa*t)*sin(x)");
  }
}

TEST(Coefficients, FormulasFilesAndUnused) {
  const std::string text = R"(
model m { field u; coefficient kappa, w, f; param c; dt(u) = div(kappa*grad(u)) + c*w*u + f }
scene s : m {
  grid x = 0 .. 1, cells 4, periodic
  c = 0
  kappa = 1 + c*x^2/2
  w = x
  f = load("f.npy")
  initial u = 0
  time 0 .. 1, step 1
})";
  const Problem p = problem_of(text);
  ASSERT_EQ(p.coefficients.size(), 2u);
  EXPECT_EQ(p.coefficients[0].name, "kappa");
  EXPECT_EQ(print(*p.coefficients[0].value.formula), "1 + c*x^2/2");
  EXPECT_EQ(p.coefficients[1].value.file, "f.npy");
  EXPECT_EQ(p.remarks.dropped, (std::vector<std::string>{"c*w*u in dt(u): c is 0", "coefficient w: nothing reads it"}));
}

TEST(Time, StepsMayMissTheirNumberByRoundingOnly) {
  const auto text = [](const std::string& time) {
    return "model m { field u; dt(u) = lap(u) }\nscene s : m { grid x = 0 .. 1, cells 4, periodic\n initial u = 0\n "
           "time " +
           time + "\n}";
  };
  EXPECT_EQ(problem_of(text("0 .. 0.3, step 0.1")).steps, 3);
  EXPECT_EQ(problem_of(text("0.1 .. 1.1, step 1/3000")).steps, 3000);
  EXPECT_EQ(problem_of(text("0 .. 1, step 1/7")).steps, 7);
  EXPECT_EQ(outcome_of(text("0 .. 1, step 0.1000001")).code_and_hint(), "E0416 a step of 0.1 makes 10 of them");
  EXPECT_EQ(outcome_of(text("0 .. 1, step 2")).code_and_hint(), "E0416 a step of 1 makes 1 of them");
}

// ---- tasks ---------------------------------------------------------------------------------------------------------

TEST(Tasks, UnknownParametersDataOfScenesAndTests) {
  const std::string text = text_with("k*lap(u) - c*w*u") + R"(
scene fine : m with other {
  grid x = 0 .. 1, cells 16, periodic
  k = 4; c = 1; w = 1
  initial u = x
  time 0 .. 2, step 1/16
}
scheme other { time = euler }
task t : s {
  data v = u from scene fine at t = 0.5, 1
  data own = u from scene s over time
  unknown k
  unknown c from 1/2
  unknown initial u
  minimise 0.5*mean((u - v)^2) at t = 2/8, 0.5
  minimise k^2 + 0.1*integral(u^2)/c, integral over time
  minimise -sum(u)
  using lbfgs
  test mae = sum(abs(u - own))/8 over time
}
)";
  const Problem p = problem_of(text);
  const Task& task = *p.task;
  EXPECT_EQ(p.find_param("k")->value, 2);
  EXPECT_EQ(p.find_param("c")->value, 3);
  EXPECT_EQ(print(p).substr(print(p).find("task t")), R"(task t : s {
  data v = u from scene fine at t = 0.5, 1
  data own = u from scene s over time
  unknown k from 2
  unknown c from 0.5
  unknown initial u from 0
  minimise 0.5*mean((u - v)^2) at t = 0.25, 0.5
  minimise k^2 + 0.1*integral(u^2)/c, integral over time
  minimise -sum(u)
  using lbfgs(), iterations 50
  test mae = sum(abs(u - own))/8 over time
}
)");
  ASSERT_EQ(task.losses.size(), 3u);
  EXPECT_EQ(task.losses[2].when.kind, When::Kind::end);
}

TEST(Tasks, AnUnknownMayGiveWhatTheSceneLeavesOut) {
  const std::string text = R"(
model m { field u; param k; dt(u) = k*lap(u) }
scene s : m { grid x = 0 .. 1, cells 4, periodic
  time 0 .. 1, step 1/4 }
task t : s {
  unknown k from 0.5
  unknown initial u from sin(2*pi*x)
  minimise mean(u^2)
})";
  const Problem p = problem_of(text);
  EXPECT_EQ(p.find_param("k")->value, 0.5);
  EXPECT_EQ(print(*p.states[0].initial.formula), "sin(2*pi*x)");
  EXPECT_FALSE(p.task->optimiser.has_value());
  EXPECT_EQ(outcome_of(text, {"s", {}, ""}).diagnostics.size(), 2u);  // without the task both are missing
}

// ---- hand-written programs -----------------------------------------------------------------------------------------

const std::string hand_written = R"(
kernel wave_step(u: field halo 1, kappa: field, x: field, out v: field, nu, hx, dt, t: param, sum total: param) {
  v = u + dt*(kappa*nu*(u[-1] - 2*u + u[+1])/hx^2 + x*t)
  total += u
}
program wave {
  fill u x.low = a, x.high = zero_gradient
  run wave_step
  swap u, v
}
loop n in 2 .. 34 { wave }
scene s : wave {
  grid x = 0 .. 1, cells 8
  nu = 0.5; a = 2*nu
  kappa = 1 + x
  initial u = x
  exact u = x + t
  observe m = mean(u)
  step 1/32
}
)";

TEST(Programs, NamesComeFromTheKernelsAndFills) {
  const Problem p = problem_of(hand_written);
  EXPECT_EQ(p.program, "wave");
  EXPECT_TRUE(p.model.empty());
  ASSERT_EQ(p.states.size(), 1u);
  EXPECT_EQ(p.states[0].name, "u");
  EXPECT_FALSE(p.states[0].rhs.has_value());
  EXPECT_EQ(p.states[0].boundary[0].low.kind, SideKind::value);
  EXPECT_EQ(print(p.states[0].boundary[0].low.value), "a");
  EXPECT_EQ(p.states[0].boundary[0].high.kind, SideKind::zero_gradient);
  ASSERT_EQ(p.params.size(), 2u);
  EXPECT_EQ(p.params[0].name, "nu");
  EXPECT_EQ(p.params[1].name, "a");
  EXPECT_EQ(p.params[1].value, 1);
  ASSERT_EQ(p.coefficients.size(), 1u);
  EXPECT_EQ(p.coefficients[0].name, "kappa");
}

TEST(Programs, TheLoopAroundThemGivesTheSteps) {
  const Problem p = problem_of(hand_written);
  EXPECT_EQ(p.steps, 32);
  EXPECT_EQ(p.step, 1.0 / 32);
  EXPECT_EQ(p.t_begin, 2.0 / 32);
  std::string timed = hand_written;
  timed.replace(timed.find("step 1/32"), 9, "time 0 .. 1; step 1/4");
  EXPECT_EQ(problem_of(timed).steps, 4);
}

/// Each name that scenes bind, and no other: nothing would give h a value.
TEST(Programs, OtherNamesThanThoseOfScenesAreParameters) {
  const auto with = [](const std::string& name, bool is_field) {
    return outcome_of("kernel k(u: field, out v: field, " + name + (is_field ? ": field" : ": param") + ") { v = u*" +
                      name + " }\nprogram p { axes x periodic, y periodic, z periodic; run k; swap u, v }\n" +
                      "scene s : p { grid x = 0 .. 1, cells 2, periodic; grid y = 0 .. 1, cells 2, periodic; grid z = "
                      "0 .. 1, cells 2, periodic\n initial u = x; time 0 .. 1, step 1 }\n")
        .diagnostics;
  };
  for (const BoundName& known : bound_names)
    EXPECT_TRUE(with(std::string(known.name), known.kind == BoundNameKind::coordinate).empty()) << known.name;
  ASSERT_EQ(with("h", false).size(), 1u);
  EXPECT_EQ(with("h", false)[0].message, "parameter h has no value");
}

TEST(Programs, FieldsWrittenOnTheWayAreNoCoefficients) {
  const Problem p = problem_of(R"(
kernel half(u: field halo 1, out m: field, dt: param) { m = u[+1] - dt*u }
kernel full(u: field, m: field halo 1, out v: field) { v = u + m[-1] }
program p { fill u periodic; run half; fill m periodic; run full; swap u, v }
scene s : p { grid x = 0 .. 1, cells 8, periodic
 initial u = x; time 0 .. 1, step 1/8 }
)");
  EXPECT_TRUE(p.coefficients.empty());
  EXPECT_TRUE(p.params.empty());
  EXPECT_EQ(p.states.size(), 1u);
}

}  // namespace
}  // namespace dpde::model
