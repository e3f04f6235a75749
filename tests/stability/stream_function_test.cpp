// SPDX-License-Identifier: Apache-2.0
// Largest stable steps of flows whose wind is solved for: RK4 is stable up to 2.8284 on the imaginary axis, where
// |u|/hx + |v|/hy is the largest rate of central(2), and runs below and above the limit.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "stability/equations.h"
#include "stability/report/local_character.h"
#include "stability/stability_report.h"
#include "stability/trial.h"
#include "stability/waves/wall_spectrum.h"
#include "stability_support.h"
#include "support/setting.h"

namespace dpde::stability {
namespace {

/// On cells of 1 between walls y = 0 and y = 16, between which `flow` flows along x.
std::string channel(const std::string& scheme, double flow, const std::string& more = "") {
  return fmt::format(
      "model m {{ field w; solve lap(psi) = -w for psi; let v = (dy(psi), -dx(psi)); dt(w) = -advect(v, w){} }}\n"
      "scheme c {{ {} }}\nscene s : m with c {{\n  grid x = 0 .. 16, cells 16, periodic\n"
      "  grid y = 0 .. 16, cells 16\n  boundary psi: y.low = 0, y.high = {}\n  boundary w: y = zero_gradient\n"
      "  initial w = 0\n  time 0 .. 1, step 0.1\n}}\n",
      more, scheme, flow);
}

/// The same wind everywhere: nothing is an estimate but the walls.
TEST(StreamFunction, LimitsAreThoseOfItsWind) {
  for (const auto& [scheme, wind, expected] : {std::tuple{"time = rk4", 2.0, 2.8284 / 2},
                                               {"time = ssp_rk3", 0.5, 1.7321 / 0.5},
                                               {"advect = upwind(1); time = euler", 1.0, 1.0},
                                               {"advect = upwind(3); time = ab2", 1.0, 0.5802}}) {
    const auto session = open_scene(channel(scheme, 16 * wind));
    const StabilityReport verdict = verdict_of(*session);
    ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << scheme << verdict.why;
    EXPECT_NEAR(verdict.limit.step, expected, 2e-3 * expected) << scheme;
    EXPECT_NEAR(verdict.courant.value_or(0), expected * wind, 2e-3 * expected * wind) << scheme;
    EXPECT_FALSE(verdict.is_exact);
    const Search found = search_limit(*session, verdict.limit.step, 4e-3, 3, {.steps = 4000});
    EXPECT_NEAR(found.largest, verdict.limit.step, 0.02 * verdict.limit.step) << scheme;
    EXPECT_NEAR(found.smallest_unstable, verdict.limit.step, 0.02 * verdict.limit.step) << scheme;
  }
}

/// The longer a wave the faster it falls, by 1/q^2: between walls the longest is twice the rod. 2/q^2 is what the
/// difference makes of it on cells of h.
TEST(StreamFunction, WavesBetweenWallsMayBeTwiceAsLongAsTheRod) {
  const auto session = open_scene(
      "model m { field u; solve lap(psi) = u for psi; dt(u) = psi }\nscheme c { time = euler }\nscene s : m with c {\n"
      "  grid x = 0 .. 1, cells 128\n  boundary psi: x = 0\n  boundary u: x = zero_gradient\n  initial u = sin(pi*x)\n"
      "  time 0 .. 1, step 0.1\n}\n");
  const StabilityReport verdict = verdict_of(*session);
  ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << verdict.why;
  const double rate = std::pow(2 * 128 * std::sin(std::numbers::pi / 256), 2);
  EXPECT_NEAR(verdict.limit.step, 2 * rate, 2e-3 * 2 * rate);
}

/// Between two sheets of vortices, +1 and -1 in two columns of cells of 1, the wind is 1/2 less its mean over 64 cells,
/// there alone: psi'' = -w summed by hand.
TEST(StreamFunction, CellNumbersAreThoseOfItsFastestSpot) {
  const auto session = open_scene(
      "model m { field w; solve lap(psi) = -w for psi; let v = (dy(psi), -dx(psi)); "
      "dt(w) = -advect(v, w) + 0.1*lap(w) }\nscene s : m {\n  grid x = 0 .. 64, cells 64, periodic\n"
      "  grid y = 0 .. 64, cells 64, periodic\n"
      "  initial w = max(0, 1 - abs(x - 33.5)/0.6) - max(0, 1 - abs(x - 34.5)/0.6)\n  time 0 .. 1, step 0.1\n}\n");
  const std::vector<CellNumber> found = cell_numbers(*session);
  ASSERT_EQ(found.size(), 1u) << "nothing flows along x";
  EXPECT_EQ(found[0].axis, 1);
  EXPECT_NEAR(found[0].number, (0.5 - 1.0 / 64) / 0.1, 1e-6);
}

/// An operator that is divided by dt has no solution where that is 0: it is not needed here, and nothing else is lost.
TEST(StreamFunction, OperatorsThatNeedAStepAreNoFault) {
  const auto session = open_scene(R"(
kernel right(u: field halo 1, k, hx: param, out b: field) on 1 axes { b = k*(u[-1] - 2*u + u[+1])/hx^2 }
kernel image(v: field halo 1, k, hx, dt: param, out r: field) on 1 axes { r = v/dt - k*(v[-1] - 2*v + v[+1])/hx^2 }
kernel add(u: field, v: field, out u_next: field) on 1 axes { u_next = u + v }
program step {
  fill u periodic
  run right
  solve r = b for v {
    fill v periodic
    run image
  }
  run add
  swap u, u_next
}
scene s : step { grid x = 0 .. 1, cells 16, periodic; k = 1; initial u = sin(2*pi*x); time 0 .. 1, step 0.1 }
)");
  const StabilityReport verdict = verdict_of(*session);
  EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::none) << "the implicit method of Euler: " << verdict.why;
  EXPECT_EQ(session->workspace().params().at("dt"), 0.1);
  EXPECT_FALSE(session->rollout().run().blow_up);
}

/// Where dt is 0 what is solved for is not known: nobody is stopped by that, and dt is what it was.
void expect_not_analysed(const std::string& text, double step) {
  const auto session = open_scene(text);
  EXPECT_EQ(verdict_of(*session).why, "what the step solves for is not known at the initial state") << text;
  EXPECT_EQ(session->workspace().params().at("dt"), step);
  DiagnosticSink sink;
  EXPECT_TRUE(check_step(*session, false, sink));
  EXPECT_TRUE(sink.all().empty());
}

/// The stage of imex_euler is the identity then, whose cells are not coupled: multigrid refuses more than 20 000.
TEST(StreamFunction, OfAMethodThatRefusesAStepOfZeroIsNotAnalysed) {
  expect_not_analysed(
      "model m { field w; solve lap(psi) = -w for psi; let v = (dy(psi), -dx(psi))\n"
      "  dt(w) = -advect(v, w) + 0.01*lap(w) }\nscheme c { time = imex_euler; solve = multigrid }\n"
      "scene s : m with c {\n  grid x = 0 .. 1, cells 160\n  grid y = 0 .. 1, cells 160\n"
      "  boundary psi: x = 0, y = 0\n  boundary w: x = 0, y = 0\n  initial w = sin(pi*x)*sin(pi*y)\n"
      "  time 0 .. 0.1, step 0.01\n}\n",
      0.01);
}

/// As of projections by hand: the right side is divided by dt.
TEST(StreamFunction, OfRightSidesDividedByTheStepIsNotAnalysed) {
  expect_not_analysed(R"(
kernel right(u: field halo 1, out b: field, dt: param) on 1 axes { b = (u[+1] - u[-1])/dt }
kernel image(p: field halo 1, out r: field) on 1 axes { r = 4*p - p[-1] - p[+1] }
kernel carry(u: field, p: field, out u_next: field, dt: param) on 1 axes { u_next = u - dt^2*p*u }
program step {
  axes x periodic
  fill u periodic
  run right
  solve r = b for p {
    fill p periodic
    run image
  }
  run carry
  swap u, u_next
}
scene s : step { grid x = 0 .. 1, cells 16, periodic; initial u = sin(2*pi*x); time 0 .. 1, step 0.1 }
)",
                      0.1);
}

/// What drives psi varies, but its values are not in the response: the worst place is the only one between walls.
TEST(StreamFunction, PlacesBetweenWallsAreThoseOfFieldsThatMatter) {
  const StabilityReport verdict = verdict_of(
      *open_scene("model m { field q; coefficient a; solve lap(psi) = -a for psi; let v = (dy(psi), -dx(psi))\n"
                  "  dt(q) = -advect(v, q) }\nscheme c { advect = upwind(1); time = euler }\nscene s : m with c {\n"
                  "  grid x = 0 .. 16, cells 16, periodic\n  grid y = 0 .. 16, cells 20\n  boundary psi: y = 0\n"
                  "  boundary q: y = zero_gradient\n  a = sin(pi*y/16)\n  initial q = 0\n  time 0 .. 1, step 0.001\n"
                  "}\n"));
  ASSERT_TRUE(verdict.is_analysed()) << verdict.why;
  EXPECT_GT(verdict.places, 1);
  EXPECT_EQ(verdict.places_between_walls, 1);
}

/// The same wind in a program: the step by hand, of Euler's method and upwind(1).
TEST(StreamFunction, OfAProgramIsKnownToo) {
  const auto session = open_scene(R"(
kernel right(w: field, out b: field) on 2 axes { b = -w }
kernel image(psi: field halo 1, out r: field) on 2 axes {
  r = psi[-1, 0] + psi[+1, 0] + psi[0, -1] + psi[0, +1] - 4*psi
}
kernel carry(w: field halo 1, psi: field halo 1, out next: field, dt: param) on 2 axes {
  let v = (psi[0, +1] - psi[0, -1])/2 + 2
  next = w - dt*v*(w - w[-1, 0])
}
program walk {
  axes x periodic, y periodic
  run right
  solve r = b for psi {
    fill psi periodic
    run image
  }
  fill w periodic
  fill psi periodic
  run carry
  swap w, next
}
scene s : walk {
  grid x = 0 .. 16, cells 16, periodic
  grid y = 0 .. 16, cells 16, periodic
  initial w = 0.1*cos(2*pi*(y - 0.5)/16)
  time 0 .. 1, step 0.1
}
)");
  const StabilityReport verdict = verdict_of(*session);
  ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << verdict.why;
  // By the differences psi is w/(2*sin(pi/16))^2, its slope sin(2*pi/16) times that.
  const double wind = 0.1 / std::pow(2 * std::sin(std::numbers::pi / 16), 2) * std::sin(std::numbers::pi / 8);
  EXPECT_NEAR(verdict.limit.step, 1 / (2 + wind), 2e-3 / (2 + wind));
  const Search found = search_limit(*session, verdict.limit.step, 4e-3, 3, {.steps = 4000});
  EXPECT_NEAR(found.largest, verdict.limit.step, 0.02 * verdict.limit.step);
}

TEST(StreamFunction, EulerByCentralDifferencesIsNeverStable) {
  const auto session = open_scene(channel("time = euler", 16));
  const StabilityReport verdict = verdict_of(*session);
  ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::never) << verdict.why;
  const auto other = stable_scheme(*session);
  ASSERT_TRUE(other.has_value());
  EXPECT_EQ(other->time, "ssp_rk3");
  EXPECT_NEAR(other->step, 1.7321, 2e-3 * 1.7321);
}

/// The vortices of Taylor and Green, 2 sin x sin y: |sin x cos y| + |cos x sin y| is at most 1. By Fourier series the
/// largest wave number is pi/h.
TEST(StreamFunction, OfVorticesIsThatOfTheirFastestPlace) {
  for (std::size_t count = 0; const auto& [differences, largest] :
                              {std::pair{"central(2)", 1.0}, {"spectral", std::numbers::pi}, {"central(4)", 1.3722}}) {
    if (!testing::is_tried(count++, 3)) continue;
    const StabilityReport verdict = verdict_of(*open_scene(fmt::format(
        "model m {{ field w; solve lap(psi) = -w for psi; let v = (dy(psi), -dx(psi)); dt(w) = -advect(v, w) }}\n"
        "scheme c {{ time = rk4; dx = {0}; lap = {0}; advect = {0} }}\nscene s : m with c {{\n"
        "  grid x = 0 .. 2*pi, cells 48, periodic\n  grid y = 0 .. 2*pi, cells 48, periodic\n"
        "  initial w = 2*sin(x)*sin(y)\n  time 0 .. 1, step 0.01\n}}\n",
        differences)));
    ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << differences << verdict.why;
    EXPECT_FALSE(verdict.is_exact);
    const double expected = 2.8284 / largest * 2 * std::numbers::pi / 48;
    EXPECT_NEAR(verdict.limit.step, expected, 0.01 * expected) << differences;
  }
}

/// Fast in a few spots, which waves leave before they have grown: told, and refused where there is no doubt.
TEST(StreamFunction, OfNarrowPeaksIsRefusedFarBeyondTheLimit) {
  const auto verdict_at = [](double step) {
    return verdict_of(*open_scene(
        fmt::format("model m {{ field w; solve lap(psi) = -w for psi; let v = (dy(psi), -dx(psi))\n"
                    "  dt(w) = -advect(v, w) + 0.01*lap(w) }}\nscheme c {{ time = rk4 }}\nscene s : m with c {{\n"
                    "  grid x = 0 .. 2*pi, cells 64, periodic\n  grid y = 0 .. 2*pi, cells 64, periodic\n"
                    "  initial w = 2*sin(x)*sin(y)\n  time 0 .. {}, step {}\n}}\n",
                    200 * step, step)));
  };
  const double limit = verdict_at(0.1).limit.step;
  EXPECT_TRUE(verdict_at(1.2 * limit).is_above());
  EXPECT_FALSE(verdict_at(1.2 * limit).ruins_run());
  EXPECT_TRUE(verdict_at(1.6 * limit).ruins_run());
}

/// Rossby's waves turn by b*kx/(kx^2 + ky^2), by these differences by b*sin(a)/(4*sin(a/2)^2) where ky is 0: most the
/// wave of 32 cells. Those that are longer than the grid would be faster yet.
TEST(StreamFunction, WavesLongerThanTheGridDoNotCount) {
  const auto session = open_scene(
      "model m { field w; solve lap(psi) = -w for psi; dt(w) = 2*dx(psi) }\nscheme c { time = rk4 }\n"
      "scene s : m with c {\n  grid x = 0 .. 32, cells 32, periodic\n  grid y = 0 .. 16, cells 16, periodic\n"
      "  initial w = cos(2*pi*x/32)\n  time 0 .. 1, step 0.01\n}\n");
  const StabilityReport verdict = verdict_of(*session);
  ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << verdict.why;
  const double longest = 2 * std::numbers::pi / 32;
  const double rate = 2 * std::sin(longest) / (4 * std::pow(std::sin(longest / 2), 2));
  EXPECT_NEAR(verdict.limit.step, 2.8284 / rate, 2e-3 * 2.8284 / rate);
  const Search found = search_limit(*session, verdict.limit.step, 4e-3, 3, {.steps = 4000});
  EXPECT_NEAR(found.largest, verdict.limit.step, 0.02 * verdict.limit.step);
}

}  // namespace
}  // namespace dpde::stability
