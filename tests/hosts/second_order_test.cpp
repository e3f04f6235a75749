// SPDX-License-Identifier: Apache-2.0
// Products of second derivatives in hosts: against differences of gradients, symmetric, and against closed forms.
#include <cmath>
#include <numbers>

#include "host_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

struct SecondOrderCase {
  std::string name, text;
};

/// Walls, a nonlinear step with stages, all kinds of unknowns; parameters that act through formulas; two fields on two
/// axes; boundary values and controls; a Courant number; reductions.
const SecondOrderCase second_order_cases[] = {
    {"Burgers", R"(model m { field u; coefficient q; param nu; dt(u) = -advect(u, u) + nu*lap(u) + q }
scheme smooth { advect = central(2); time = rk2 }
scene s : m with smooth {
  grid x = 0 .. 1, cells 9
  boundary u: x.low = 0.2, x.high = zero_gradient
  nu = 0.02
  q = x
  initial u = sin(3*x)
  time 0 .. 0.2, step 0.02
}
task t : s { unknown nu; unknown q from 0.5*x; unknown initial u
  minimise mean((u - 0.5)^4) over time
  minimise 1e-2*nu^2 + 1e-3*mean(dx(q)^2) })"},
    {"Formulas", R"(model m { field u; coefficient q, r; param a, b; dt(u) = a*lap(u) + q*u - u^3 + r }
scheme e { time = euler }
scene s : m with e {
  grid x = 0 .. 1, cells 7, periodic
  a = 0.05
  b = 0.7
  q = exp(b*x)*a
  r = x
  initial u = b^2*sin(2*pi*x) + a*b
  time 0 .. 0.2, step 0.04
}
task t : s { unknown b; unknown r from 0.3*x; unknown a
  minimise mean(u^4) at t = 0.08, 0.2
  minimise mean((u - b)^2) })"},
    {"TwoFields", R"(model m { field u, v; param k, f
  dt(u) = k*lap(u) - u*v^2 + f*(1 - u)
  dt(v) = k*lap(v) + u*v^2 - f*v }
scheme e { time = rk4 }
scene s : m with e {
  grid x = 0 .. 1, cells 3
  grid y = 0 .. 1, cells 4, periodic
  boundary u: x = zero_gradient
  boundary v: x.low = k*y, x.high = 0
  k = 0.01
  f = 0.1
  initial u = 1 - 0.5*x
  initial v = f + y
  time 0 .. 0.3, step 0.1
}
task t : s { unknown f; unknown k; unknown initial u
  minimise mean(u*v) + mean(v^2) over time })"},
    {"Controls", R"(model m { field u; param D; control F; dt(u) = D*lap(u) + F*u }
scheme e { time = rk2 }
scene s : m with e {
  grid x = 0 .. 1, cells 5
  D = 0.05
  boundary u: x.low = F, x.high = 0
  initial u = x
  F = 0.3 every 0.1
  time 0 .. 0.3, step 0.05
}
task t : s { unknown D; unknown F from sin(9*t) in -3 .. 3
  minimise mean((u - 1)^2)
  minimise 0.1*F^4, mean over time })"},
    {"ControlFields", R"(model m { field u; param D; control field F, G; dt(u) = D*lap(u) + F*u + dx(G*u) }
scheme e { time = rk2 }
scene s : m with e {
  grid x = 0 .. 1, cells 5
  D = 0.05
  boundary u: x.low = F, x.high = 0
  initial u = x
  F = 0.3*x every 0.1
  G = t every 0.15
  time 0 .. 0.25, step 0.05
}
task t : s { unknown D; unknown F from sin(9*t)*x in -3 .. 3; unknown G
  minimise mean((u - 1)^2)
  minimise 0.1*mean((F*u)^2) + mean(G^4) over time })"},
    {"Courant", R"(model m { field u; param a; dt(u) = -advect(a*u, u) }
scheme e { advect = central(2); time = euler }
scene s : m with e {
  grid x = 0 .. 1, cells 6, periodic
  a = 1
  initial u = 1 + 0.3*sin(2*pi*x)
  time 0 .. 0.2, step 0.05, courant 0.1
}
task t : s { unknown a; unknown initial u; minimise sum(u^4) })"},
    {"Reductions",
     R"(model m { field u; param tau, a; dt(u) = -(u - mean(u, x))/tau - mean(u, x)*dy(mean(u, x)) + a*(1 - integral(u^2)*u) }
scheme e { time = euler }
scene s : m with e {
  grid x = 0 .. 1, cells 4, periodic
  grid y = 0 .. 1, cells 3
  boundary u: y.low = 0, y.high = zero_gradient
  tau = 0.5
  a = 0.1
  initial u = sin(2*pi*x)*y + y^2
  time 0 .. 0.2, step 0.05
}
task t : s { unknown tau; unknown a; unknown initial u; minimise mean((u - mean(u))^2) + mean(u^4) })"},
};

/// Fourth-order differences of the gradient.
std::vector<double> differences(Simulation& sim, const std::vector<double>& x, const std::vector<double>& v) {
  constexpr double h = 2e-4;
  std::vector<double> sum(x.size());
  for (const auto& [steps, weight] : {std::pair{1, 8.0}, {-1, -8.0}, {2, -1.0}, {-2, 1.0}}) {
    std::vector<double> at = x;
    for (std::size_t i = 0; i < x.size(); ++i) at[i] += steps * h * v[i];
    sim.set_unknowns(at);
    sim.gradient();
    for (std::size_t i = 0; i < x.size(); ++i) sum[i] += weight * sim.gradient_vector()[i] / (12 * h);
  }
  sim.set_unknowns(x);
  return sum;
}

double distance(std::span<const double> a, std::span<const double> b) {
  double square = 0;
  for (std::size_t i = 0; i < a.size(); ++i) square += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(square / dot(b, b));
}

class HessianVector : public ::testing::TestWithParam<int> {};

TEST_P(HessianVector, IsTheDerivativeOfTheGradientAndSymmetric) {
  const SecondOrderCase& c = second_order_cases[GetParam()];
  for (const std::string cells : {"", "1", "2", "3"}) {
    const Settings set = cells.empty() ? Settings{} : Settings{{"cells", cells}};
    Simulation sim = compile_text(c.text, {.name = "t", .set = set, .second_order = true});
    std::vector<double> x = sim.unknown_values();
    const std::vector<double> shift = random_values(x.size(), 1, 0.02), v = random_values(x.size(), 2),
                              w = random_values(x.size(), 3);
    for (int again = 0; again < 2; ++again) {  // where the task starts, with its formulas, and elsewhere
      const std::vector<double> hv = sim.hessian_vector(v), hw = sim.hessian_vector(w);
      EXPECT_NEAR(dot(w, hv), dot(v, hw), 1e-12 * std::sqrt(dot(v, v) * dot(hw, hw))) << cells;
      EXPECT_LT(distance(hv, differences(sim, x, v)), 2e-9) << c.name << " cells " << cells << " at " << again;
      for (std::size_t i = 0; i < x.size(); ++i) x[i] += shift[i];
      sim.set_unknowns(x);
    }
  }
}

TEST_P(HessianVector, IsTheSameOnEveryBackEndAndWithCheckpoints) {
  if (!is_tried(GetParam(), 2)) GTEST_SKIP() << "at night";
  const SecondOrderCase& c = second_order_cases[GetParam()];
  Simulation sim = compile_text(c.text, {.name = "t", .second_order = true});
  const std::vector<double> v = random_values(sim.unknown_values().size(), 4), expected = sim.hessian_vector(v);
  for (const HostBackend backend : {HostBackend::cpp, HostBackend::interpreter}) {
    Simulation other = compile_text(c.text, {.name = "t", .backend = backend, .second_order = true});
    EXPECT_LT(distance(other.hessian_vector(v), expected), 1e-13);
  }
  Simulation few = compile_text(c.text, {.name = "t", .slots = 2, .second_order = true});
  EXPECT_EQ(few.hessian_vector(v), expected);
  const double loss = sim.gradient();
  EXPECT_EQ(few.gradient(), loss) << "products leave what the gradient begins with";
}

INSTANTIATE_TEST_SUITE_P(Tasks, HessianVector, ::testing::Range(0, static_cast<int>(std::size(second_order_cases))),
                         [](const auto& info) { return second_order_cases[info.param].name; });

std::string rod_with_task(const std::string& initial, const std::string& task) {
  return R"(
model heat { field u; param k; dt(u) = k*lap(u) }
scheme ftcs { lap = central(2); time = euler }
scene rod : heat with ftcs {
  grid x = 0 .. 2*pi, cells 16, periodic
  k = 0.25
  initial u = )" +
         initial + "\n  time 0 .. 1, step 1/8\n}\ntask find : rod {\n" + task + "\n}\n";
}

/// A step scales sin(x) by f = 1 - k r: the loss is k^4 f^16/2, the residual k^2 f^8 sin(x).
TEST(GaussNewton, IsTheClosedForm) {
  Simulation sim = compile_text(rod_with_task("k^2*sin(x)", "unknown k; minimise mean(u^2)"),
                                {.name = "find", .second_order = true});
  const std::vector<double> one{1};
  const double h = 2 * std::numbers::pi / 16, r = 4.0 / 8 / (h * h) * std::pow(std::sin(h / 2), 2);
  for (const double k : {0.25, 0.4}) {
    sim.set("k", k);
    const double f = 1 - k * r;
    const double full = 6 * k * k * std::pow(f, 16) - 64 * k * k * k * r * std::pow(f, 15) +
                        120 * std::pow(k, 4) * r * r * std::pow(f, 14);
    const double slope = 2 * k * std::pow(f, 8) - 8 * k * k * r * std::pow(f, 7);
    EXPECT_NEAR(sim.hessian_vector(one)[0], full, 1e-13);
    EXPECT_NEAR(sim.hessian_vector(one, Curvature::gauss_newton)[0], slope * slope, 1e-13);
  }
  std::vector<double> wave = sim.coordinates(0);
  for (double& value : wave) value = std::sin(value);
  sim.set_initial("u", wave);  // now the formula is not used: f^16/2 and f^8 sin(x)
  const double f = 1 - 0.4 * r;
  EXPECT_NEAR(sim.hessian_vector(one)[0], 120 * r * r * std::pow(f, 14), 1e-13);
  EXPECT_NEAR(sim.hessian_vector(one, Curvature::gauss_newton)[0], 64 * r * r * std::pow(f, 14), 1e-13);
}

/// Where the data are met exactly both matrices are one.
TEST(GaussNewton, IsTheHessianWhereTheResidualsAreZero) {
  std::string text = second_order_cases[1].text;
  text.replace(text.find("minimise mean(u^4)"), std::string::npos,
               "data d = u from scene s at t = 0.08, 0.2\n  minimise mean((u - d)^2) at t = 0.08, 0.2 }");
  Simulation sim = compile_text(text, {.name = "t", .second_order = true});
  sim.set_field("r", sim.coordinates(0));  // the scene's own
  EXPECT_LT(sim.loss(), 1e-30);
  const std::vector<double> v = random_values(sim.unknown_values().size(), 5), w = random_values(v.size(), 6);
  const std::vector<double> product = sim.hessian_vector(v, Curvature::gauss_newton);
  EXPECT_LT(distance(product, sim.hessian_vector(v)), 1e-12);
  std::vector<double> x = sim.unknown_values();
  x[0] += 0.1;
  sim.set_unknowns(x);
  const std::vector<double> elsewhere = sim.hessian_vector(v, Curvature::gauss_newton);
  EXPECT_GT(distance(elsewhere, sim.hessian_vector(v)), 1e-3);
  EXPECT_GT(dot(v, elsewhere), 0);
  EXPECT_NEAR(dot(w, elsewhere), dot(v, sim.hessian_vector(w, Curvature::gauss_newton)),
              1e-12 * std::abs(dot(v, elsewhere)));
}

/// A coefficient that the host gives does not follow its formula any more, nor does an initial state.
TEST(HessianVectorOfHosts, LeavesOutFormulasThatAreNotUsed) {
  Simulation sim = compile_text(second_order_cases[1].text, {.name = "t", .second_order = true});
  const std::vector<double> x = sim.unknown_values(), v = random_values(x.size(), 7);
  std::vector<double> before = sim.hessian_vector(v);
  for (const char* given : {"q", "u"}) {
    const std::vector<double> values = random_values(sim.size(), 9);
    if (*given == 'q') sim.set_field(given, values);
    if (*given == 'u') sim.set_initial(given, values);
    const std::vector<double> product = sim.hessian_vector(v);
    EXPECT_LT(distance(product, differences(sim, x, v)), 2e-9) << given;
    EXPECT_GT(distance(product, before), 1e-3) << given;
    before = product;
  }
}

std::string error_of(const std::function<void()>& body) {
  try {
    body();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    return error.what();
  }
  return "no error";
}

TEST(HessianVectorErrors, SayWhatIsMissing) {
  const std::vector<double> one{1};
  Simulation without = compile_text(rod_with_task("sin(x)", "unknown k; minimise mean(u^2)"), {.name = "find"});
  EXPECT_NE(error_of([&] { without.hessian_vector(one); }).find("HostOptions::second_order"), std::string::npos);
  Simulation other = compile_text(rod_with_task("sin(x)", "unknown k; minimise mean(u^2)\n minimise mean(exp(u))"),
                                  {.name = "find", .second_order = true});
  EXPECT_NE(error_of([&] {
              other.hessian_vector(one, Curvature::gauss_newton);
            }).find("loss 2 of task find is not a sum of squares"),
            std::string::npos);
  EXPECT_TRUE(std::isfinite(other.hessian_vector(one)[0]));
  EXPECT_NE(error_of([&] { other.hessian_vector(std::vector<double>(2)); }).find("1 values, the direction has 2"),
            std::string::npos);
  EXPECT_NE(error_of([&] { other.set_unknowns(std::vector<double>(3)); }).find("the vector of values has 3"),
            std::string::npos);
  Simulation scene =
      compile_text(rod_with_task("sin(x)", "unknown k; minimise mean(u^2)"), {.name = "rod", .second_order = true});
  EXPECT_NE(error_of([&] { scene.hessian_vector(one); }).find("without a task"), std::string::npos);
}

using SecondOrderAhead = InFolder;

TEST_F(SecondOrderAhead, IsAsInMemory) {
  const std::string file = write("t.dpde", second_order_cases[1].text);
  const dpde_scene* scene = build(file, "t", " --second-order");
  ASSERT_NE(scene, nullptr);
  Simulation ahead(*scene), in_memory = compile_file(file, {.name = "t", .second_order = true});
  const std::vector<double> v = random_values(in_memory.unknown_values().size(), 8);
  for (int again = 0; again < 2; ++again) {
    EXPECT_LT(distance(ahead.hessian_vector(v), in_memory.hessian_vector(v)), 1e-12);
    for (Simulation* sim : {&ahead, &in_memory}) sim->set("b", 0.4);
  }
}

TEST_F(SecondOrderAhead, WithoutTheOptionIsAnErrorAndNewtonHasIt) {
  const std::vector<double> one{1};
  const dpde_scene* plain =
      build(write("plain.dpde", rod_with_task("sin(x)", "unknown k; minimise mean(u^2)")), "find");
  ASSERT_NE(plain, nullptr);
  Simulation without(*plain);
  EXPECT_NE(error_of([&] { without.hessian_vector(one); }).find("dpde build --second-order"), std::string::npos);
  std::string text =
      rod_with_task("sin(x)", "unknown k; minimise mean(u^2)\n  using newton_cg(hessian = gauss_newton), iterations 3");
  const dpde_scene* newton =
      build(write("newton.dpde", text.replace(text.find("task find"), 9, "task newton")), "newton");
  ASSERT_NE(newton, nullptr);
  Simulation with(*newton), in_memory = compile_text(text, {.name = "newton"});
  EXPECT_GT(with.hessian_vector(one)[0], 0);
  const Optimised ahead = with.optimise(), here = in_memory.optimise();
  EXPECT_EQ(ahead.iterations, 3);
  EXPECT_GT(ahead.hessian_products, 0);
  EXPECT_NEAR(with.value_of("k")[0], in_memory.value_of("k")[0], 1e-12);
  EXPECT_NEAR(ahead.loss, here.loss, 1e-14);
}

}  // namespace
}  // namespace dpde::testing
