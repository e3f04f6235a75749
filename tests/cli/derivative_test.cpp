// SPDX-License-Identifier: Apache-2.0
// Derivatives through the command for programs more complex than a model's step.
#include <cmath>
#include <set>
#include <sstream>

#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

class DerivativeCommand : public Command {};

/// A result that the step itself reads (p_next), one periodic and one bounded axis, an odd number of steps. The seed's
/// buffer of one gradient is the result's of the next; nothing of it may remain.
TEST_F(DerivativeCommand, GradientIsTheSameEachTime) {
  write("symplectic.dpde", R"(
kernel kp(p: field, v: field halo 1, out p_next: field, dt, hx, hy: param) {
  p_next = p - dt*((v[+1, 0] - v)/hx + (v[0, +1] - v)/hy)
}
kernel kv(v: field, p_next: field halo 1, out v_next: field, dt, hx, hy: param) {
  v_next = v - dt*((p_next - p_next[-1, 0])/hx + (p_next - p_next[0, -1])/hy)
}
program step {
  axes x periodic, y bounded
  fill v x periodic, y = 0
  run kp
  fill p_next x periodic, y = zero_gradient
  run kv
  swap p, p_next
  swap v, v_next
}
scene s : step {
  grid x = 0 .. 1, cells 6, periodic
  grid y = 0 .. 1, cells 5
  initial p = sin(2*pi*x)*y + y^2
  initial v = cos(2*pi*x)*(1 - y)
  time 0 .. 0.03, step 1/100
}
task t : s {
  unknown initial p
  minimise integral((p - 1)^2 + v^2) at t = 0.03
  using gradient_descent(rate = 1e-30), iterations 5
}
)");
  const Outcome optimised = dpde("optimize symplectic.dpde");
  ASSERT_EQ(optimised.status, 0) << optimised.err;
  std::istringstream lines(optimised.out + optimised.err);
  std::set<std::string> norms;
  int count = 0;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t place = line.find("  gradient ");
    if (!line.starts_with("iteration") || place == std::string::npos) continue;
    norms.insert(line.substr(place));
    ++count;
  }
  EXPECT_EQ(count, 6);
  EXPECT_EQ(norms.size(), 1u) << optimised.out;
  EXPECT_EQ(dpde("verify symplectic.dpde t --json").status, 0);
}

constexpr const char* implicit_text = R"(
kernel begin(u: field, out w: field) { w = u }
kernel jacobi(u: field, w: field halo 1, out v: field, nu, dt, hx: param) {
  let c = nu*dt/hx^2
  v = (u + c*(w[-1] + w[+1]))/(1 + 2*c)
}
program step {
  run begin
  repeat PASSES {
    fill w periodic
    run jacobi
    swap w, v
  }
  swap u, w
}
scene rod : step {
  grid x = 0 .. 1, cells 16, periodic
  nu = 0.05
  initial u = sin(2*pi*x) + x
  time 0 .. 0.5, step 1/16
}
task find : rod {
  unknown nu from 0.02
  unknown initial u
  minimise mean((u - 0.2)^2) at t = 0.25, 0.5
  using lbfgs(), iterations 3
}
)";

std::string implicit_with(int passes) {
  std::string text = implicit_text;
  return text.replace(text.find("PASSES"), 6, std::to_string(passes));
}

/// Passes of a repeat: certified derivatives of first and second order, equal for both back ends and for the emitted
/// text; code size does not grow with the number of passes.
TEST_F(DerivativeCommand, OfARepeatedKernelIsCertified) {
  write("few.dpde", implicit_with(4));
  write("many.dpde", implicit_with(40));
  const Outcome verified = dpde("verify many.dpde --json");
  EXPECT_EQ(verified.status, 0) << verified.out << verified.err;
  const Json jit = dpde("gradient many.dpde --json").json(),
             cpp = dpde("gradient many.dpde --json --backend cpp").json();
  EXPECT_NEAR(jit["loss"].get<double>(), cpp["loss"].get<double>(), 1e-14);
  EXPECT_NEAR(jit["gradient"]["nu"]["value"].get<double>(), cpp["gradient"]["nu"]["value"].get<double>(), 1e-12);
  ASSERT_EQ(shell("$DPDE emit many.dpde rod --stage stencil > emitted.dpde").status, 0);
  EXPECT_NE(content(path("emitted.dpde")).find("  } to w_2\n"), std::string::npos);
  ASSERT_EQ(dpde("run many.dpde rod --quiet --out a").status, 0);
  ASSERT_EQ(dpde("run emitted.dpde rod --quiet --out b").status, 0);
  EXPECT_GT(content(path("a/u.npy")).size(), 16u * sizeof(double));
  EXPECT_EQ(content(path("a/u.npy")), content(path("b/u.npy")));
  for (const char* stage : {"loop", "adjoint-loop"}) {
    const auto rows = [&](const std::string& file) {
      return shell("$DPDE emit " + file + " find --stage " + stage + " | grep -c ^row").out;
    };
    EXPECT_EQ(rows("many.dpde"), rows("few.dpde")) << stage;
  }
  EXPECT_EQ(dpde("fmt many.dpde").status, 0);
  EXPECT_NE(content(path("many.dpde")).find("  repeat 40 {\n    fill w periodic\n"), std::string::npos);
}

/// One kernel with two boundaries has two adjoints.
TEST_F(DerivativeCommand, ProgramsThatShareAKernelHaveDerivativesOfTheirOwn) {
  write("two.dpde", R"(
kernel k(u: field halo 1, out v: field) { v = 2*u[+1]*u + 3*u[-1] }
program around { fill u periodic
  run k
  swap u, v }
program wall { fill u x = 0
  run k
  swap u, v }
)");
  const Outcome verified = dpde("verify two.dpde --json");
  EXPECT_EQ(verified.status, 0) << verified.err;
  EXPECT_TRUE(verified.json()["passed"].get<bool>());
}

/// x^m with x = 0: the derivative with respect to m is the limit 0, not 0*log(0).
TEST_F(DerivativeCommand, ExponentAtZeroHasADerivative) {
  write("power.dpde", R"(
model decay { field u; param m; dt(u) = -u^m }
scheme e { time = euler }
scene s : decay with e { grid x = 0 .. 1, cells 4, periodic
  m = 2
  initial u = max(x - 0.5, 0)
  time 0 .. 0.2, step 0.1 }
task t : s { unknown m from 2
  minimise sum(u) }
)");
  const Outcome gradient = dpde("gradient power.dpde t --json");
  ASSERT_EQ(gradient.status, 0) << gradient.err;
  // two Euler steps by hand from u = 0, 0, 1/8, 3/8 at m = 2
  double expected = 0;
  for (const double u : {0.125, 0.375}) {
    const double first = u - 0.1 * u * u, d_first = -0.1 * u * u * std::log(u);
    expected += d_first - 0.1 * (first * first * std::log(first) + 2 * first * d_first);
  }
  EXPECT_NEAR(gradient.json()["gradient"]["m"]["value"].get<double>(), expected, 1e-14);
}

/// A damped wave together with a field of first order; the velocity is one of the unknowns.
TEST_F(DerivativeCommand, SecondTimeDerivativesAreCertified) {
  write("wave.dpde", R"(
model wave { field u, w; param c, g; dt(dt(u)) = c^2*lap(u) - g*lap(dt(u))*u - w*dt(u)^2; dt(w) = lap(w) - u*dt(u) }
scene s : wave {
  grid x = 0 .. 1, cells 8, periodic
  grid y = 0 .. 1, cells 5
  boundary u: y.low = 0.2, y.high = zero_gradient
  boundary w: y = 0
  c = 1.3
  g = 0.01
  initial u = 1 + 0.3*sin(2*pi*x)*y
  initial dt(u) = cos(2*pi*x)
  initial w = 0.4*cos(2*pi*x) - 0.1*y
  time 0 .. 0.02, step 0.005
}
task t : s {
  unknown initial dt(u) from 0.1
  unknown c from 1
  minimise mean((u - 1)^2 + 0.01*dt(u)^2) over time
}
)");
  for (const char* arguments : {"s", "t", "s --set time=verlet", "t --set time=verlet --backend cpp",
                                "s --set time=ab2", "t --set time=ab2", "t --set time=ssp_rk3 --backend interpreter"}) {
    const Outcome verified = dpde(std::string("verify wave.dpde --json ") + arguments);
    EXPECT_EQ(verified.status, 0) << arguments << verified.out << verified.err;
  }
  const Outcome formatted = dpde("emit wave.dpde s --stage ast");
  EXPECT_NE(formatted.out.find("dt(dt(u)) = "), std::string::npos);
  EXPECT_NE(formatted.out.find("initial dt(u) = cos(2*pi*x)"), std::string::npos);
}

/// Multistep schemes: the first step differs, and leapfrog's velocity is that of half a step before.
TEST_F(DerivativeCommand, SchemesThatRememberAreCertified) {
  write("wave.dpde", R"(
model wave { field u, w; param c, g; dt(dt(u)) = c^2*lap(u)*u - g*dt(u)*w + t; dt(w) = lap(w)*u - w }
scheme s { time = leapfrog }
scene s : wave {
  grid x = 0 .. 1, cells 8, periodic
  grid y = 0 .. 1, cells 5
  boundary u: y.low = 0.2, y.high = zero_gradient
  boundary w: y = 0
  c = 1.3
  g = 0.3
  initial u = 1 + 0.3*sin(2*pi*x)*y*c
  initial dt(u) = g*cos(2*pi*x)
  initial w = 0.4*cos(2*pi*x) - 0.1*y
  time 0 .. 0.02, step 0.005
}
task t : s {
  unknown initial dt(u) from 0.1
  unknown c from 1
  unknown g
  minimise mean((u - 1)^2 + w) over time
}
)");
  for (const char* arguments : {"s", "t", "t --backend cpp", "s --backend interpreter", "t --set time=ab2"}) {
    const Outcome verified = dpde(std::string("verify wave.dpde --json ") + arguments);
    EXPECT_EQ(verified.status, 0) << arguments << verified.out << verified.err;
  }
  EXPECT_NE(dpde("emit wave.dpde s --stage stencil").out.find("swap w_old, w_old_next"), std::string::npos);
}

/// Departure points that depend on the state, cubic along one and two axes.
TEST_F(DerivativeCommand, CubicSemiLagrangianIsCertified) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  write("carry.dpde", R"(
model line { field u; param nu; dt(u) = -advect(u, u) + nu*lap(u) }
model plane { field u, v; param nu; dt(u) = -advect((u, v), u) + nu*lap(u); dt(v) = -advect((u, v), v) - u }
scheme s { advect = semi_lagrangian(cubic); time = rk2 }
scene one : line {
  grid x = 0 .. 1, cells 13, periodic
  nu = 0.01
  initial u = 1 + 0.3*sin(2*pi*x)
  time 0 .. 0.4, step 0.1
}
scene two : plane {
  grid x = 0 .. 1, cells 6, periodic
  grid y = 0 .. 1, cells 5, periodic
  nu = 0.01
  initial u = 1 + 0.3*sin(2*pi*x)
  initial v = -0.6 + 0.2*cos(2*pi*y)
  time 0 .. 0.3, step 0.1
}
)");
  for (const char* arguments : {"one", "two", "one --backend interpreter", "two --backend cpp"}) {
    const Outcome verified = dpde(std::string("verify carry.dpde --json ") + arguments);
    EXPECT_EQ(verified.status, 0) << arguments << verified.out << verified.err;
  }
}

/// Along one, two and three axes, at walls that also depend on an unknown; with unknown velocities.
TEST_F(DerivativeCommand, TransportAlongTheFlowIsCertifiedAtWalls) {
  write("carry.dpde", R"(
model line { field u; param c, A; dt(u) = -advect(c + 0.3*u, u) }
model plane { field u, v; dt(u) = -advect((u + 0.1*mean(u), v + 0.01*dx(u)), u); dt(v) = -advect((u, v), v) - u }
model space { field q; param c; dt(q) = -advect((c, -0.3*q, q), q) }
scheme s { advect = maccormack; time = rk2 }
scene one : line {
  grid x = 0 .. 1, cells 12
  boundary u: x.low = 0.3*A, x.high = zero_gradient
  c = 0.4
  A = 1.1
  initial u = 0.33 + 0.3*cos(3*x)
  time 0 .. 0.3, step 0.1
}
scene two : plane {
  grid x = 0 .. 1, cells 6
  grid y = 0 .. 1, cells 5, periodic
  boundary u: x = 0.3
  boundary v: x.low = zero_gradient, x.high = gradient(0.1)
  initial u = 0.5 + 0.3*sin(2*pi*x)*cos(2*pi*y)
  initial v = -0.6 + 0.2*cos(2*pi*y)
  time 0 .. 0.3, step 0.1
}
scene three : space {
  grid x = 0 .. 1, cells 4
  grid y = 0 .. 1, cells 3, periodic
  grid z = 0 .. 1, cells 5
  boundary q: x = 0.4, z = zero_gradient
  c = 0.7
  initial q = 0.5 + 0.2*sin(2*pi*x + 1) + 0.1*z
  time 0 .. 0.2, step 0.1
}
task speed : one { unknown initial u; unknown c; minimise mean(u^2) + mean((u - 0.2)^2) over time }
task wall : one { unknown A; minimise mean((u - 0.2)^2) over time }
)");
  std::vector<std::string> all{"two", "wall"};
  if (is_thorough()) {  // a C++ compiler takes long
    all.insert(all.end(), {"three", "speed"});
    all.insert(all.end(), {"speed --backend interpreter", "speed --backend cpp", "two --backend cpp"});
    all.insert(all.end(), {"two --set real=f32"});
  }
  for (const std::string& arguments : all) {
    for (const std::string advect : {"maccormack", "semi_lagrangian_cubic"}) {
      const Outcome verified = dpde("verify carry.dpde --json " + arguments + " --set advect=" + advect);
      EXPECT_EQ(verified.status, 0) << arguments << verified.out << verified.err;
    }
  }
}

/// Every difference and time scheme of the language, with walls, certified also on grids of one cell.
TEST_F(DerivativeCommand, EveryDifferenceAndTimeSchemeIsCertified) {
  write("burgers.dpde", R"(
model burgers { field u, v; param nu; dt(u) = -advect((u, v), u) + nu*lap(u); dt(v) = -u*dx(v) + nu*lap(v) - v*u }
scene s : burgers {
  grid x = 0 .. 1, cells 9, periodic
  grid y = 0 .. 1, cells 7
  boundary u: y.low = 0.2, y.high = zero_gradient
  boundary v: y = 0.1
  nu = 0.01
  initial u = 1 + 0.3*sin(2*pi*x)*y
  initial v = 0.4*cos(2*pi*x) - 0.1*y
  time 0 .. 0.04, step 0.01
}
)");
  std::vector<std::string> sets{"advect=central6 --set dx=central8 --set lap=central6 --set time=ssp_rk3",
                                "advect=upwind3 --set dx=central6 --set lap=central8 --set time=rk2",
                                "advect=central8 --set time=euler",
                                "time=imex_euler",
                                "time=ars443 --set lap=central4",
                                "time=leapfrog --set lap=central8"};
  if (is_thorough())  // by day other tests certify them
    sets.insert(sets.end(), {"advect=semi_lagrangian_cubic", "advect=maccormack", "time=ab2", "time=ars222"});
  for (const std::string& set : sets) {
    const Outcome verified = dpde("verify burgers.dpde --json --set " + set);
    EXPECT_EQ(verified.status, 0) << set << verified.out << verified.err;
  }
}

/// dx(g) is 0 on one and two cells: one product is 0, the other rounding.
TEST_F(DerivativeCommand, AVanishingDerivativeIsCertified) {
  write("zero.dpde",
        "model m { field s; coefficient g; dt(s) = s*(1 + dx(g)) }\nscheme e { time = euler }\nscene j : m with e {\n"
        "  grid x = 0 .. 2, cells 6, periodic\n  g = sin(pi*x)\n  initial s = x\n  time 0 .. 0.2, step 1/20\n}\n"
        "task r : j { unknown g; minimise mean(s^2) }\n");
  EXPECT_EQ(dpde("verify zero.dpde r --json").status, 0);
}

TEST_F(DerivativeCommand, AStartWithoutADerivativeIsNotCertified) {
  write("n.dpde",
        "model m { field u; dt(u) = sqrt(u) }\n"
        "scene s : m { grid x = -1 .. 1, cells 3, periodic\n  initial u = if(abs(x) < 0.1, 0, 0.3)\n  time 0 .. 1, "
        "step 0.5 }\n"
        "task q : s { unknown initial u; minimise mean(u^2); using lbfgs() }\n");
  const Outcome refused = dpde("verify n.dpde q --json");
  EXPECT_EQ(refused.status, 1);
  EXPECT_EQ(refused.json()["start_is_finite"], false);
  EXPECT_NE(refused.err.find("at the start itself"), std::string::npos) << refused.err;
  write("p.dpde",
        "model m { field u; dt(u) = sqrt(u) }\nscene s : m { grid x = -1 .. 1, cells 3, periodic\n  initial u = 0.3\n  "
        "time 0 .. 1, step 0.5 }\n"
        "task q : s { unknown initial u; minimise mean(u^2); using lbfgs() }\n");
  EXPECT_EQ(dpde("verify p.dpde q").status, 0);
}

TEST_F(DerivativeCommand, AnUnknownWithoutADerivativeIsAnErrorOfVerifyToo) {
  write(
      "w.dpde",
      "kernel step(w: field halo 1, out v: field, dt, hx: param) {\n  v = w + 0.3*dt/hx^2*(w[-1] - 2*w + w[+1])\n}\n"
      "program two {\n  fill w x.low = a, x.high = 0\n  run step\n  swap w, v\n}\n"
      "scene s : two {\n  grid x = 0 .. 1, cells 7\n  a = 0.7\n  initial w = sin(pi*x)\n  time 0 .. 0.5, step 0.01\n}\n"
      "task q : s { unknown a; minimise mean((w - 0.5)^2); using lbfgs() }\n"
      "task s_certificate : s { unknown a; minimise mean((w - 0.5)^2); using lbfgs() }\n");
  for (const std::string task : {"q", "s_certificate"}) {
    for (const std::string verb : {"verify", "gradient", "optimize"}) {
      const Outcome refused = dpde(verb + " w.dpde " + task);
      EXPECT_EQ(refused.status, 2) << verb << task;
      EXPECT_NE(refused.err.find("E0604"), std::string::npos) << refused.err;
    }
  }
  EXPECT_EQ(dpde("verify w.dpde s").status, 0) << "of a scene: by what has a derivative";
}

/// The passes of a repeat fill v, w, w_2, ...; the file contains v once.
TEST_F(DerivativeCommand, AnUnknownInAFillOfARepeatIsToldOnce) {
  write("r.dpde",
        "kernel jacobi(v: field, f: field, out w: field) {\n  w = (v[+1] + v[-1] + f)/2\n}\nprogram p {\n  repeat 8 {\n"
        "    fill v x.low = 0, x.high = q\n    run jacobi\n    swap v, w\n  }\n}\n"
        "scene s : p { grid x = 0 .. 1, cells 16; initial v = 0; f = 1; q = 0.5; time 0 .. 1, step 0.1 }\n"
        "task g : s { unknown q from 0.5; minimise mean(v^2) at t = 1 }\n");
  const Outcome refused = dpde("check r.dpde g --json");
  EXPECT_EQ(refused.status, 2);
  ASSERT_EQ(refused.codes(), std::vector<std::string>{"E0604"});
  const Json said = refused.json()["diagnostics"][0];
  EXPECT_EQ(said["line"], 6);
  EXPECT_EQ(said["column"], 10);
  EXPECT_EQ(said["message"], "a boundary value of field v depends on an unknown");
}

/// Data that are a state of another run have that state's values beyond walls: compared with a twin of the scene,
/// differences and samples vanish. This also holds if the walls contain unknowns, for which derivatives are exact.
TEST_F(DerivativeCommand, DataOfAStateHaveItsBoundary) {
  write("twin.dpde",
        "model d { field u; param k, a; dt(u) = k*lap(u) }\n"
        "scene p : d {\n  grid x = 0 .. 1, cells 8\n  grid y = 0 .. 1, cells 6, periodic\n  k = 0.01\n  a = 0.8\n"
        "  initial u = sin(3*x)*(1 + 0.3*sin(2*pi*y))\n"
        "  boundary u: x.low = a*(1 + 0.2*cos(2*pi*y)), x.high = mixed(1, 0.2, exp(-t))\n  time 0 .. 1, step 1/16\n}\n"
        "task twin : p {\n  data r = u from scene p over time\n  unknown k from 0.01\n  unknown a from 0.8\n"
        "  minimise mean(dx(u - r)^2) + mean((lap(u) - lap(r))^2) over time\n"
        "  minimise (sample(u, at = (0.01, 0.3)) - sample(r, at = (0.01, 0.3)))^2, sum over time\n"
        "  using newton_cg()\n}\n"
        "task off : p {\n  data r = u from scene p over time\n  unknown k from 0.02\n  unknown a from 0.5\n"
        "  minimise mean((dx(u) - dx(r))^2) + 0.1*mean(dx(u)*lap(r)) over time\n  using newton_cg()\n}\n");
  const Outcome twin = dpde("gradient twin.dpde twin --json");
  ASSERT_EQ(twin.status, 0) << twin.err;
  EXPECT_LT(std::abs(double(twin.json()["loss"])), 1e-24);
  const Outcome proven = dpde("verify twin.dpde off --json");
  EXPECT_EQ(proven.status, 0) << proven.out << proven.err;
}

/// A program fills a coefficient's ghost cells with values, the loss mirrors it: each uses its own, forward and
/// backward.
TEST_F(DerivativeCommand, ProgramsThatFillACoefficientDifferentlyDoNotSpoilOneAnother) {
  write(
      "c.dpde",
      "kernel k(w: field halo 1, c: field halo 1, out v: field, dt: param) { v = w + dt*(c[+1]*(w[+1] - w) - c[-1]*(w "
      "- w[-1])) }\n"
      "program p { fill w x = 1; fill c x = 2; run k; swap w, v }\n"
      "scene s : p {\n  grid x = 0 .. 1, cells 6\n  initial w = sin(2*pi*x)\n  c = 1 + x\n  time 0 .. 1, step 1/20\n}\n"
      "task end : s { unknown c from 1; minimise mean(w^2) + 0.5*mean(dx(c)^2); using lbfgs() }\n"
      "task over : s { unknown c from 1; minimise mean(w^2) + 0.5*mean(dx(c)^2) over time; using lbfgs() }\n");
  for (const std::string task : {"end", "over"}) {
    const Json compiled = dpde("gradient c.dpde " + task + " --json").json(),
               interpreted = dpde("gradient c.dpde " + task + " --json --backend interpreter").json();
    EXPECT_NEAR(double(compiled["loss"]), double(interpreted["loss"]), 1e-14) << task;
    EXPECT_NEAR(double(compiled["gradient"]["c"]["norm"]), double(interpreted["gradient"]["c"]["norm"]), 1e-14) << task;
    EXPECT_EQ(dpde("verify c.dpde " + task).status, 0) << task;
  }
}

/// The bounds of maccormack jump next to the point: the derivative there is still right, and the jump is reported.
TEST_F(DerivativeCommand, JumpsOfBoundsAreToldBesideTheCertificate) {
  const Outcome outcome = dpde("verify " DPDE_SOURCE_DIR "/dsl-examples/smoke/smoke.dpde left");
  EXPECT_EQ(outcome.status, 0) << outcome.out;
  EXPECT_NE(outcome.out.find("the loss jumps by"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("certified but for p, nu and for jumps at the bounds of maccormack"), std::string::npos)
      << outcome.out;
}

}  // namespace
}  // namespace dpde::testing
