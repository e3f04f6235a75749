// SPDX-License-Identifier: Apache-2.0
// Implicit time schemes with nonlinear reactions (implicit = all, all_but_advect): orders on stiff nonlinear equations
// with exact solutions, stability functions, the stiff Brusselator against published values, gradients against central
// differences, and messages if Newton's method does not converge.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "../driver/driver_support.h"
#include "dpde/runtime/unsolved.h"
#include "support/scene_run.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

/// Exact in space, as the solution is linear in x. The stiff terms are nonlinear and couple the fields.
const std::string reacting = R"(
function e(x, t) = 2 + sin(t)*x
function e_rate(x, t) = cos(t)*x
model pair {
  field u, v
  param stiff, nu
  dt(u) = nu*lap(u) + stiff*(v - u^2) + e_rate(x, t)
  dt(v) = nu*lap(v) - stiff*(u*v - e(x, t)^3) + 2*e(x, t)*e_rate(x, t) - 2*nu*sin(t)^2
}
model carried { field u; param stiff, nu
  dt(u) = -advect(1, u) + nu*lap(u) - stiff*(u^3 - e(x, t)^3) + e_rate(x, t) + sin(t)
}
model on_faces { field u on faces.x; param stiff, nu
  dt(u) = nu*lap(u) - stiff*(u^3 - e(x, t)^3) + e_rate(x, t)
}
scheme s { time = ars222; implicit = all }
scene still : pair with s {
  grid x = 0 .. 1, cells 4
  stiff = 0.5
  nu = 0
  boundary u: x = zero_gradient
  boundary v: x = zero_gradient
  initial u = 2
  initial v = 4
  exact u = e(x, t)
  exact v = e(x, t)^2
  time 0 .. 1, step 1/8
}
scene stream : carried with s {
  grid x = 0 .. 1, cells 6
  stiff = 0.3
  nu = 0.05
  boundary u: x.low = e(0, t), x.high = e(1, t)
  initial u = 2
  exact u = e(x, t)
  time 0 .. 1, step 1/8
}
scene faces : on_faces with s {
  grid x = 0 .. 1, cells 6
  stiff = 0.3
  nu = 0.05
  boundary u: x.low = e(0, t), x.high = e(1, t)
  initial u = 2
  exact u = e(x, t)
  time 0 .. 1, step 1/8
}
)";

double error_of(const std::string& scene, const std::string& time, const std::string& step, Overrides overrides = {}) {
  overrides["time"] = time;
  overrides["step"] = step;
  return run_scene(reacting, scene, overrides).l2.begin()->second;
}

void expect_order_by_newton(const std::string& scene, const std::string& time, double order, double finest_bound,
                            const Overrides& overrides = {}) {
  const std::vector<double> errors{error_of(scene, time, "1/32", overrides), error_of(scene, time, "1/64", overrides),
                                   error_of(scene, time, "1/128", overrides)};
  const std::string text = fmt::format("{} {}: errors {}", scene, time, fmt::join(errors, " "));
  EXPECT_NEAR(std::log2(errors[0] / errors[1]), order, 0.25) << text;
  EXPECT_NEAR(std::log2(errors[1] / errors[2]), order, 0.2) << text;
  EXPECT_LT(errors[2], finest_bound) << text;
}

TEST(NewtonOrder, OfReactionsInEachCell) {
  expect_order_by_newton("still", "backward_euler", 1, 1e-1);
  expect_order_by_newton("still", "crank_nicolson", 2, 1e-3);
  expect_order_by_newton("still", "ars222", 2, 1e-3);
  expect_order_by_newton("still", "ars443", 3, 1e-4);
}

TEST(NewtonOrder, OfReactionsDiffusionAndTransport) {
  for (const char* implicit : {"all", "all_but_advect"}) {
    expect_order_by_newton("stream", "imex_euler", 1, 1e-1, {{"implicit", implicit}});
    expect_order_by_newton("stream", "ars222", 2, 1e-3, {{"implicit", implicit}});
    expect_order_by_newton("stream", "ars443", 3, 1e-4, {{"implicit", implicit}});
  }
}

TEST(NewtonOrder, OfWhatLiesOnWalls) {
  expect_order_by_newton("faces", "backward_euler", 1, 1e-1);
  expect_order_by_newton("faces", "ars222", 2, 1e-3);
  expect_order_by_newton("faces", "ars443", 3, 1e-4);
}

/// A reaction a million times faster than the step: L-stable methods stay on the slow solution. In the limit a stiffly
/// accurate method has only the error of its end point, which lies on it (Hairer and Wanner 1996, IV.15).
TEST(NewtonOrder, StaysOnTheSlowSolutionOfAVeryStiffReaction) {
  for (const char* time : {"backward_euler", "ars222", "ars443"})
    EXPECT_LT(error_of("still", time, "1/16", {{"stiff", "1e6"}}), 1e-5) << time;
}

/// Amplification factor of a step for dt(u) = z*u/h.
double left_by_newton(const std::string& scheme, double z) {
  if (scheme == "crank_nicolson") return (1 + z / 2) / (1 - z / 2);
  if (scheme == "ars222") {
    const double g = 1 - std::sqrt(0.5);
    return (1 + (1 - 2 * g) * z) / ((1 - g * z) * (1 - g * z));
  }
  if (scheme == "ars443") {
    const double d = 1 - z / 2, a = 1 / d, b = (1 + z * a / 6) / d, c = (1 - z * a / 2 + z * b / 2) / d;
    return (1 + 1.5 * z * a - 1.5 * z * b + z * c / 2) / d;
  }
  return 1 / (1 - z);
}

TEST(NewtonDecay, IsWhatTheStabilityFunctionSays) {
  const std::string text = R"(
model decay { field u; param k; dt(u) = -k*u }
scheme s { implicit = all }
scene spot : decay with s { grid x = 0 .. 1, cells 3, periodic; k = 1; initial u = 1 + x; time 0 .. 4, step 1 }
)";
  for (const std::string scheme : {"backward_euler", "crank_nicolson", "ars222", "ars443"}) {
    for (const double k : {1e-3, 1.0, 50.0, 1e6}) {
      for (const auto backend : {driver::Backend::jit, driver::Backend::interpreter}) {
        const std::vector<double> u =
            run_scene(text, "spot", {{"time", scheme}, {"k", fmt::format("{}", k)}}, backend).state.at("u");
        const double left = std::pow(left_by_newton(scheme, -k), 4);
        for (std::size_t i = 0; i < u.size(); ++i)
          EXPECT_NEAR(u[i], left * (1 + (static_cast<double>(i) + 0.5) / 3), 1e-12) << scheme << " " << k;
      }
    }
  }
}

/// A linear equation by Newton's method, and by separate linear solves of each field.
TEST(Newton, TakesALinearEquationAsTheLinearSolvesDo) {
  const std::string text = R"(
model heat { vector u; param nu; dt(u) = nu*lap(u) }
scheme s { time = ars443 }
scene plate : heat with s {
  grid x = 0 .. 1, cells 9
  grid y = 0 .. 1, cells 8, periodic
  nu = 0.3
  boundary u: x.low = (0.2, cos(t)), x.high = zero_gradient
  initial u = (sin(3*x)*cos(2*pi*y), x)
  time 0 .. 0.5, step 0.1
}
)";
  const SceneResult linear = run_scene(text, "plate");
  for (const char* solve : {"automatic", "direct", "bicgstab"}) {
    const SceneResult found = run_scene(text, "plate", {{"implicit", "all"}, {"solve", solve}});
    for (const char* field : {"u.x", "u.y"}) {
      for (std::size_t i = 0; i < linear.state.at(field).size(); ++i)
        EXPECT_NEAR(found.state.at(field)[i], linear.state.at(field)[i], 1e-10) << field << i << solve;
    }
  }
}

std::string reacting_task(const std::string& time, int rank, bool periodic, const char* implicit) {
  std::string text =
      "model m { vector u; field q; coefficient k; param c\n"
      "  dt(u) = -c*advect(u, u) + k*lap(u) - 3*dot(u, u)*u + q*u\n"
      "  dt(q) = c*div(k*grad(q)) + 2*q*(1 - q) + c*dx(u.x) + 0.1*mean(u.x^2) + sin(3*t)*x }\n";
  text += "scheme p { time = " + time + "; implicit = " + implicit + " }\nscene s : m with p {\n  c = 0.9\n" +
          "  k = 0.02 + 0.01*sin(2*pi*x)\n";
  for (int axis = 0; axis < rank; ++axis)
    text += "  " + grid(std::string(1, "xy"[axis]), axis == 0 ? 7 : 5, periodic || axis > 0);
  const std::string low = rank == 1 ? "0.2*cos(t)" : "(0.2*cos(t), 0.1)";
  if (!periodic)
    text += "  boundary u: x.low = " + low +
            ", x.high = zero_gradient\n  boundary q: x.low = mixed(1, c, t), x.high = 0.1\n";
  text += rank == 1 ? "  initial u = 0.3*sin(4*pi*x + 0.3) + 0.07\n"
                    : "  initial u = (0.3*sin(4*pi*x + 0.3) + 0.07, 0.2*cos(2*pi*y*40/6) + 0.03)\n";
  return text +
         "  initial q = 0.5 + 0.4*cos(4*pi*x + 1)\n  time 0 .. 0.05, step 0.01\n}\n"
         "task t : s {\n  unknown c\n  unknown k\n  unknown initial u\n  unknown initial q\n"
         "  minimise mean(dot(u, u) + q^2)\n}\n";
}

TEST(NewtonCertificate, OfAllSchemes) {
  for (const char* scheme : {"backward_euler", "crank_nicolson", "ars222", "ars443"}) {
    for (const bool periodic : {true, false}) {
      if (!periodic && !is_thorough()) continue;  // by day the two below cover walls
      SCOPED_TRACE(fmt::format("{} {}", scheme, periodic));
      expect_certified(reacting_task(scheme, 1, periodic, "all"), true);
    }
  }
  expect_certified(reacting_task("ars222", 2, false, "all"), false);
  expect_certified(reacting_task("ars222", 1, false, "all_but_advect"), true);
}

std::string brusselator(int cells, const std::string& rest) {
  return fmt::format(R"(
model brusselator {{
  field u on faces.x
  field v on faces.x
  field w on faces.x
  param a, b, eps, Du, Dv, Dw
  dt(u) = Du*lap(u) + a - (w + 1)*u + v*u^2
  dt(v) = Dv*lap(v) + w*u - v*u^2
  dt(w) = Dw*lap(w) + (b - w)/eps - w*u
}}
scheme stiff {{ implicit = all; time = ars443 }}
scene tube : brusselator with stiff {{
  grid x = 0 .. 1, cells {}
  a = 0.6; b = 2; eps = 1e-5
  Du = 0.025; Dv = 0.025; Dw = 0.025
  boundary u = a
  boundary v = b/a
  boundary w = b
  initial u = a + 0.1*sin(pi*x)
  initial v = b/a + 0.1*sin(pi*x)
  initial w = b + 0.1*sin(pi*x)
  {}
)",
                     cells, rest);
}

/// Over the points, including x = 0.
double rms(const std::vector<double>& values, double at_begin) {
  double sum = at_begin * at_begin;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size() + 1));
}

/// SUNDIALS, examples/arkode/C_serial/ark_brusselator1D: 201 points, root mean squares as printed by that program.
TEST(Brusselator, HasTheValuesOfSundials) {
  struct Reference {
    const char *end, *step;
    double u, v, w;
  };
  for (const Reference& wanted :
       {Reference{"0.1", "1/400", 0.673914, 3.377329, 1.999987}, Reference{"1", "1/200", 0.791136, 3.140509, 1.999984},
        Reference{"2", "1/200", 0.960034, 2.757426, 0}}) {
    const SceneResult found =
        run_scene(brusselator(200, "time 0 .. 1, step 1/100\n}"), "tube", {{"end", wanted.end}, {"step", wanted.step}});
    EXPECT_NEAR(rms(found.state.at("u"), 0.6), wanted.u, 1e-5) << wanted.end;
    EXPECT_NEAR(rms(found.state.at("v"), 2 / 0.6), wanted.v, 1e-5) << wanted.end;
    if (wanted.w > 0) EXPECT_NEAR(rms(found.state.at("w"), 2), wanted.w, 1e-5) << wanted.end;
  }
}

TEST(Brusselator, HasTheGradientOfCentralDifferences) {
  const std::string task =
      "time 0 .. 10, step 1/10\n}\ntask t : tube { unknown a from 0.6; unknown b from 2; unknown Du from 0.025\n"
      "  unknown Dv from 0.025; unknown Dw from 0.025; minimise mean(u^2 + v^2 + w^2) }\n";
  const auto loss_at = [&](const std::string& unknown, double value) {
    std::string text = brusselator(16, task);
    const std::string from = "unknown " + unknown + " from ";
    const std::size_t begin = text.find(from) + from.size(), end = text.find_first_of(";\n", begin);
    return task_loss(text.replace(begin, end - begin, fmt::format("{}", value)), "t");
  };
  const TaskResult found = task_gradient(brusselator(16, task), "t");
  for (const auto& [unknown, value] :
       std::map<std::string, double>{{"a", 0.6}, {"b", 2}, {"Du", 0.025}, {"Dv", 0.025}, {"Dw", 0.025}}) {
    const double h = 1e-3 * value;  // differences of order 4; the rounding of the loss, about 17, over h gives the 1e-9
    const double slope = (8 * (loss_at(unknown, value + h) - loss_at(unknown, value - h)) -
                          (loss_at(unknown, value + 2 * h) - loss_at(unknown, value - 2 * h))) /
                         (12 * h);
    EXPECT_NEAR(found.gradient.at(unknown).front(), slope, 1e-6 * std::abs(slope) + 1e-9) << unknown;
  }
}

/// Products of small numbers underflow long before the numbers do.
TEST(ImplicitSteps, OfWhatHasNearlyDecayedAreThoseOfOtherSizes) {
  const std::string rod = R"(
model heat { field u; param nu, size; dt(u) = nu*lap(u) - 2*u }
model cubic { field u; param nu, size, start; dt(u) = nu*lap(u) - 2*u - 4*u^3/size^2 }
scheme s { time = backward_euler }
scheme all { time = backward_euler; implicit = all }
scene linear : heat with s {
  grid x = 0 .. 1, cells 16
  nu = 0.1; size = 1
  boundary u: all = 0
  initial u = size*sin(3*x)
  time 0 .. 1, step 1/8
}
scene newton : cubic with all {
  grid x = 0 .. 1, cells 16
  nu = 0.1; size = 1; start = 1
  boundary u: all = 0
  initial u = size*start*sin(3*x)
  time 0 .. 1, step 1/8
}
)";
  const auto end_of = [&](const std::string& scene, Overrides overrides) {
    return run_scene(rod, scene, overrides).state.at("u");
  };
  for (const char* method : {"tridiagonal", "direct", "multigrid", "cg", "gmres", "bicgstab"}) {
    const std::vector<double> unit = end_of("linear", {{"solve", method}});
    for (const double size : {1e-140, 1e-200, 1e-280, 1e200}) {
      const std::vector<double> other = end_of("linear", {{"solve", method}, {"size", fmt::format("{}", size)}});
      for (std::size_t i = 0; i < unit.size(); ++i)
        EXPECT_NEAR(other[i] / size, unit[i], 1e-9 * std::abs(unit[i])) << method << " " << size;
    }
  }
  const std::vector<double> unit = end_of("newton", {});
  for (const double size : {1e-100, 1e100}) {  // cubes of larger powers overflow
    const std::vector<double> other = end_of("newton", {{"size", fmt::format("{}", size)}});
    for (std::size_t i = 0; i < unit.size(); ++i) EXPECT_NEAR(other[i] / size, unit[i], 1e-9 * std::abs(unit[i]));
  }
  const std::vector<double> linear = end_of("newton", {{"start", "1e-20"}});  // the cube is below rounding
  for (const double start : {1e-200, 1e-300}) {
    const std::string text = fmt::format("{}", start);
    const std::vector<double> other = end_of("newton", {{"start", text}});
    for (std::size_t i = 0; i < other.size(); ++i)
      EXPECT_NEAR(other[i] / start, linear[i] / 1e-20, 1e-9 * std::abs(linear[i] / 1e-20)) << start;
  }
  for (const double start : {1e-310, 5e-324}) {  // subnormal numbers with few digits
    for (const double value : end_of("newton", {{"start", fmt::format("{}", start)}}))
      EXPECT_LE(std::abs(value), start);
  }
}

/// A field of 1e-40 next to one of 1: the rounding of the large field in a Newton step exceeds the small one.
TEST(ImplicitSteps, OfFieldsOfVeryDifferentSizesEnd) {
  const std::string text = R"(
model m { field u, v
  dt(u) = 0.07*lap(u) + advect(0.6, u)
  dt(v) = 0.12*lap(v) - advect(2.6, v) + 0.08*lap(u) }
scheme s { time = imex_euler; implicit = all_but_advect }
scene one : m with s {
  grid x = 0 .. 1, cells 20, stretched 0.3*x + 0.7*x^2
  boundary u: all = mixed(17, 1, 0)
  boundary v: x.low = mixed(20, 1, 0), x.high = linear
  initial u = SIZE*sin(pi*x)
  initial v = 1
  time 0 .. 1, step 1/16
}
)";
  const auto state_of = [&](const std::string& size) {
    std::string with = text;
    return run_scene(with.replace(with.find("SIZE"), 4, size), "one").state;
  };
  const auto none = state_of("0"), small = state_of("1e-40");
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_NEAR(small.at("v")[i], none.at("v")[i], 1e-12);
    EXPECT_LT(std::abs(small.at("u")[i]), 1e-28);
  }
}

/// x + k*x^2 = c next to a field that is 1e11 times as large, in single precision: without coupling accuracy is full.
TEST(ImplicitSteps, OfSmallFieldsBesideLargeOnesAreSolvedInSinglePrecision) {
  const std::string text = R"(
model m { field p, c; param k; dt(p) = 0.01*lap(p); dt(c) = -k*c^2 }
scheme s { time = backward_euler; implicit = all; real = f32 }
scene one : m with s {
  grid x = 0 .. 1, cells 8, periodic
  k = 1e6
  initial p = 1e5
  initial c = 1e-6
  exact c = 1e-6*2/(1 + sqrt(1 + 4*k*1e-6))
  time 0 .. 1, step 1
}
)";
  for (const double k : {1e6, 1e8, 1e10}) {
    const double exact = (std::sqrt(1 + 4 * k * 1e-6) - 1) / (2 * k);
    EXPECT_LT(run_scene(text, "one", {{"k", fmt::format("{}", k)}}).l2.at("c"), 1e-5 * exact) << k;
  }
}

/// X - h*exp(X) = R has no solution if R is above -1 - log(h).
TEST(Newton, SaysThatItDoesNotConverge) {
  const std::string text = R"(
model flame { field u; dt(u) = exp(u) }
scheme s { time = backward_euler; implicit = all }
scene spot : flame with s { grid x = 0 .. 1, cells 3, periodic; initial u = 0; time 0 .. 2, step 0.5 }
)";
  try {
    run_scene(text, "spot");
    FAIL() << "no solution was found";
  } catch (const Unsolved& error) {
    const std::string said = error.what();
    EXPECT_NE(said.find("newton for u_solved: after"), std::string::npos) << said;
    EXPECT_NE(error.hint().find("take a shorter time step"), std::string::npos) << error.hint();
    EXPECT_NE(said.find("step"), std::string::npos) << said;
  }
}

/// Checks run a scene with arbitrary values, for which a solution may not exist; this must not stop the actual run.
TEST(Newton, RunsWhereMadeUpValuesHaveNoSolution) {
  const std::string text = R"(
model grow { field a, b; param k; dt(a) = -a*b^2; dt(b) = a*b^2 - k*b }
scheme s { time = ars222; implicit = all }
scene spot : grow with s { grid x = 0 .. 1, cells 4, periodic; k = 1; initial a = 1; initial b = 0.01; time 0 .. 40, step 10 }
task t : spot { unknown k from 1; minimise mean(b) }
)";
  EXPECT_NEAR(run_scene(text, "spot").state.at("a").front(), 1, 1e-2);
  const double h = 1e-4, up = task_loss(std::string(text).replace(text.find("k from 1"), 8, "k from 1.0001"), "t"),
               down = task_loss(std::string(text).replace(text.find("k from 1"), 8, "k from 0.9999"), "t");
  EXPECT_NEAR(task_gradient(text, "t").gradient.at("k").front(), (up - down) / (2 * h), 1e-8);
}

/// One field decays to 0 next to one that stays: rounding from the other field must not count as divergence.
TEST(Newton, FieldsThatDecayBesideOthersAreSolved) {
  const std::string text = R"(
model pair { field u, v; dt(u) = 0.381*lap(u); dt(v) = 0.438*lap(v) - advect(-0.312, v) - 0.279*dx(u) }
scheme s { advect = upwind(5); dx = central(4); implicit = all; time = ars443 }
scene rod : pair with s {
  grid x = 0 .. 4.12, cells 9
  boundary u: x.low = zero_gradient, x.high = linear
  boundary v: x.low = zero_gradient, x.high = mixed(2.032, 1, 0)
  initial u = noise(1); initial v = noise(1)
  time 0 .. 1500, step 1
}
)";
  const std::vector<double> v = run_scene(text, "rod").state.at("v");
  EXPECT_LT(std::abs(*std::ranges::max_element(v, {}, [](double x) { return std::abs(x); })), 1e-12);
}

}  // namespace
}  // namespace dpde::testing
