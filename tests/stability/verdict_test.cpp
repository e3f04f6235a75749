// SPDX-License-Identifier: Apache-2.0
// Verdicts on whole scenes, against closed forms at the places, times and values that limit them: h^2/(2 d k) of
// diffusion by Euler's method and central differences.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "stability/stability_report.h"
#include "stability_support.h"

namespace dpde::stability {
namespace {

StabilityReport verdict_on(const std::string& text) { return verdict_of(*open_scene(text)); }

StabilityReport verdict_on(const std::string& equation, const std::string& more, const std::string& scheme,
                           const std::string& initial = "sin(2*pi*x/64)", int rank = 1) {
  std::string text = "model m { field u; " + equation + " }\nscheme c { " + scheme + " }\nscene s : m with c {\n";
  for (int axis = 0; axis < rank; ++axis) text += fmt::format("  grid {} = 0 .. 64, cells 64, periodic\n", "xyz"[axis]);
  return verdict_on(text + "  initial u = " + initial + "\n" + more + "\n}\n");
}

const std::string run = "  time 0 .. 1, step 1/400";

/// A coefficient that is large in one spot, for a moment, or in one interval of a control.
TEST(StabilityReport, FindsWhereAndWhenCoefficientsAreLargest) {
  const auto limit_of = [](const std::string& equation, const std::string& more, double k) {
    const StabilityReport verdict = verdict_on(equation, more, "time = euler", "sin(2*pi*x/64)", 2);
    EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << equation;
    EXPECT_FALSE(verdict.is_exact);
    EXPECT_NEAR(verdict.limit.step, 0.25 / k, 0.02 * 0.25 / k) << equation;
  };
  limit_of("dt(u) = (1 + 99*exp(-(x - 23.5)^2))*lap(u)", run, 100);
  limit_of("dt(u) = (0.01 + exp(-((t - 0.25)/0.05)^2))*lap(u)", run, 1.01);
  limit_of("dt(u) = sin(2*pi*t)^2*lap(u)", run, 1);
  limit_of("control F; dt(u) = F*lap(u)", "  F = 1 + 9*t every 0.1\n" + run, 1 + 9 * 0.95);
  limit_of("dt(u) = if(x < 20, 0, 1)*lap(u)", run, 1);
}

/// The quick look: around limits of closed forms (0.5 of diffusion, less between walls by what eigenvalues of 32 cells
/// are; 1 of upwind transport), where equations grow by themselves, and where walls alone let something grow.
TEST(GrowsNothing, IsSaidOfStableStepsAlone) {
  const auto is_said = [](const std::string& equation, const std::string& scheme, const std::string& boundary,
                          double step) {
    return grows_nothing(*open_scene(fmt::format(
        "model m {{ field u; {} }}\nscheme c {{ {} }}\nscene s : m with c {{\n  grid x = 0 .. 64, cells 64{}\n"
        "  initial u = sin(2*pi*x/64)\n  time 0 .. {}, step {}\n}}\n",
        equation, scheme, boundary, 1000 * step, step)));
  };
  const std::string ring = ", periodic";
  EXPECT_TRUE(is_said("dt(u) = lap(u)", "time = euler", ring, 0.49));
  EXPECT_FALSE(is_said("dt(u) = lap(u)", "time = euler", ring, 0.51));
  EXPECT_TRUE(is_said("dt(u) = lap(u) + 0.3*u", "time = euler", ring, 0.45));
  EXPECT_FALSE(is_said("dt(u) = lap(u) + 0.3*u", "time = euler", ring, 0.55));
  EXPECT_TRUE(is_said("dt(u) = -advect(1, u)", "advect = upwind(1); time = euler", ring, 0.99));
  EXPECT_FALSE(is_said("dt(u) = -advect(1, u)", "advect = central(2); time = euler", ring, 0.1));
  for (const std::string side : {"zero_gradient", "0"}) {
    EXPECT_TRUE(is_said("dt(u) = lap(u)", "time = euler", "\n  boundary u: x = " + side, 0.49)) << side;
    EXPECT_FALSE(is_said("dt(u) = lap(u)", "time = euler", "\n  boundary u: x = " + side, 0.52)) << side;
  }
  const std::string outflow = "\n  boundary u: x.low = 0, x.high = zero_gradient";
  EXPECT_FALSE(is_said("dt(u) = -advect(1, u)", "advect = central(2); time = leapfrog", outflow, 0.5));
}

/// A dependence that is hidden by a condition does not make a verdict exact.
TEST(StabilityReport, IsExactWhereAllPlacesAreAlike) {
  EXPECT_TRUE(verdict_on("dt(u) = lap(u)", run, "time = euler").is_exact);
  EXPECT_FALSE(verdict_on("dt(u) = if(x > 30, 0, 4*lap(u))", run, "time = euler", "1", 2).is_exact);
  EXPECT_FALSE(verdict_on("dt(u) = lap(u) - u^3", run, "time = euler").is_exact);
}

/// norm(grad(u)) is not 0 because the field is frozen: the coefficient of dt(u) = lap(u)*|u_x| is its slope, pi/32.
TEST(StabilityReport, KnowsSlopes) {
  const StabilityReport verdict = verdict_on("dt(u) = abs(dx(u))*lap(u)", run, "time = euler");
  ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
  EXPECT_NEAR(verdict.limit.step, 0.5 / (std::numbers::pi / 32), 0.05 * 0.5 / (std::numbers::pi / 32));
}

/// A scheme with a memory is looked at behind its first step, with coefficients of the run's own times.
TEST(StabilityReport, OfASchemeWithAMemoryKnowsTheTime) {
  const StabilityReport verdict =
      verdict_on("dt(u) = -advect(1 + 0.1*t, u)", "  time 0 .. 10, step 1/10", "advect = upwind(1); time = ab2");
  ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
  EXPECT_NEAR(verdict.limit.step, 0.5 / 2, 0.01);
}

/// c dt/h of RK4 with central differences along all three axes: 2 sqrt(2)/(3 m), m the largest of the symbol,
/// 1.3722 with central(4), 1.5860 with central(6): waves that lie between those of the scan.
TEST(StabilityReport, FindsNarrowPeaksInThreeDimensions) {
  for (const auto& [order, largest] : {std::pair{4, 1.3722}, {6, 1.5860}}) {
    const StabilityReport verdict =
        verdict_on("dt(u) = -advect((1, 1, 1), u)", "  time 0 .. 0.1, step 0.1",
                   fmt::format("advect = central({}); time = rk4", order), "sin(2*pi*x/64)", 3);
    ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
    EXPECT_NEAR(verdict.limit.step, 2.8284 / (3 * largest), 2e-3);
  }
}

/// A difference from the wrong side grows as fast as cells are small: no growth of the equations.
TEST(StabilityReport, DoesNotForgiveDifferencesThatGrow) {
  const StabilityReport verdict = verdict_on(
      "dt(u) = -fwd(u) }\noperator fwd(f) order 1 = (f[+1] - f)/hx\nmodel other { field u; "
      "dt(u) = lap(u)",
      run, "time = rk4");
  EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::never);
}

/// Short waves too: with L*u = u - 0.02*(8 + d^2)^2 u the wave of k^2 = 8 grows by exp(t), here on 5 cells; heat
/// that runs backward lets the shortest one grow most, by 4*k/h^2. Reactions of a Brusselator on cells that hardly
/// resolve its waves; the growth that differences know of is not more than that of numerics.md, section 7.
TEST(StabilityReport, ForgivesWhatTheEquationsDoToShortWaves) {
  const auto on_cells = [](const std::string& equations, double h, const std::string& scheme, double step) {
    return verdict_on(
        fmt::format("model m {{ field u; {} }}\nscheme c {{ {} }}\nscene s : m with c {{\n"
                    "  grid x = 0 .. {}, cells 32, periodic\n  initial u = 2\n{}"
                    "  time 0 .. {}, step {}\n}}\n",
                    equations, scheme, 32 * h,
                    equations.find("field v") == std::string::npos ? "" : "  initial v = 1.5\n", 100 * step, step));
  };
  const StabilityReport band = on_cells("dt(u) = u - 0.02*(lap(lap(u)) + 16*lap(u) + 64*u)", 0.44, "time = rk4", 1e-3);
  EXPECT_FALSE(band.is_above());
  double fastest = 0;  // of the waves that 32 cells have, as the equations and as differences have it
  for (int n = 1; n <= 16; ++n) {
    const double half = std::numbers::pi * n / 32;
    const auto rate = [](double k) { return 1 - 0.02 * (8 - k * k) * (8 - k * k); };
    fastest = std::max(fastest, std::min(rate(2 * half / 0.44), rate(2 * std::sin(half) / 0.44)));
  }
  EXPECT_NEAR(band.growth_rate, fastest, 1e-6);
  const StabilityReport back = on_cells("dt(u) = -0.01*lap(u)", 1.0 / 64, "time = rk4", 1e-3);
  EXPECT_FALSE(back.is_above());
  EXPECT_NEAR(back.growth_rate, 4 * 0.01 * 64 * 64, 1e-3 * back.growth_rate);
  const std::string reactions = "field v; dt(u) = 2 - 4*u + u^2*v + 0.1*lap(u); dt(v) = 3*u - u^2*v + lap(v)";
  const StabilityReport spots = on_cells(reactions, 0.5, "time = euler", 1e-2);
  EXPECT_FALSE(spots.is_above());
  EXPECT_NEAR(spots.growth_rate, 0.2323441889, 0.05 * 0.2323441889);
  const StabilityReport too_long =
      on_cells(reactions, 0.5, "time = euler", 0.2);  // 4/h^2*step is 3.2: the diffusion of v
  EXPECT_TRUE(too_long.is_above());
}

/// Constants fall by a factor of 1 - a*dt in a step of Euler's method, whatever waves do; runs say so too.
TEST(StabilityReport, KnowsWhatMeansFeedBack) {
  const auto limit_of = [](const std::string& rate, double expected, int rank = 1) {
    const StabilityReport verdict = verdict_on("dt(u) = " + rate, run, "time = euler", "1 + sin(2*pi*x/64)", rank);
    ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << rate;
    EXPECT_NEAR(verdict.limit.step, expected, 1e-3 * expected) << rate;
  };
  limit_of("-50*mean(u)", 2.0 / 50);
  limit_of("-sum(u)", 2.0 / 64);
  limit_of("lap(u) - 50*mean(u)", 2.0 / 50);
  limit_of("lap(u) - 1*mean(u)", 0.5);
  limit_of("-50*mean(u, x)", 2.0 / 50, 2);
  limit_of("-50*(u - mean(u))", 2.0 / 50);
  EXPECT_EQ(verdict_on("dt(u) = 50*mean(u)", run, "time = euler").limit.kind, StepLimit::Kind::none);
  for (const auto& [step, is_bounded] : {std::pair(0.039, true), {0.041, false}}) {
    const auto session = open_scene(fmt::format(
        "model m {{ field u; dt(u) = -50*mean(u) }}\nscheme c {{ time = euler }}\nscene s : m with c {{\n"
        "  grid x = 0 .. 64, cells 64, periodic\n  initial u = 1 + sin(2*pi*x/64)\n  time 0 .. {}, step {}\n}}\n",
        1000 * step, step));
    session->rollout().run();
    EXPECT_EQ(std::abs(session->final_state(0)[0]) < 2, is_bounded) << step;
  }
}

/// The quick look and the search for a limit agree, between walls too and in steps far below the limit of waves.
TEST(StabilityReport, AgreesWithTheQuickLook) {
  for (const std::string time : {"euler", "rk2", "ab2", "ab3", "leapfrog", "rk4"}) {
    for (const std::string advect : {"central(2)", "upwind(1)", "upwind(3)"}) {
      for (const std::string sides : {"x.low = 0, x.high = zero_gradient", "x.low = 0, x.high = linear"}) {
        for (const double step : {0.05, 0.3}) {
          const auto session = open_scene(fmt::format(
              "model m {{ field u; dt(u) = -advect(1, u) }}\nscheme s {{ advect = {}; time = {} }}\nscene s : m with s "
              "{{\n  grid x = 0 .. 24, cells 24\n  boundary u: {}\n  initial u = x\n  time 0 .. {}, step {}\n}}\n",
              advect, time, sides, 1000 * step, step));
          EXPECT_EQ(grows_nothing(*session), !verdict_of(*session).is_above()) << advect << time << sides << step;
        }
      }
    }
  }
}

/// Of advection by central differences and forward Euler, diffusion solved for: |1 - i*v*dt/h*sin a| stays below
/// 1 + 4*k*dt/h^2*sin(a/2)^2 for all a up to dt = 2*k/v^2.
TEST(StabilityReport, OfImplicitSchemesIsThatOfWhatIsExplicit) {
  for (const char* scheme : {"backward_euler", "crank_nicolson", "imex_euler", "ars222", "ars443"}) {
    const StabilityReport verdict =
        verdict_on("dt(u) = (2 + sin(2*pi*x/64))*lap(u)", run, std::string("time = ") + scheme);
    EXPECT_TRUE(verdict.is_analysed()) << scheme;
    EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::none) << scheme;
  }
  for (const int rank : {1, 2}) {
    const std::string speed = rank == 1 ? "2" : "(2, 0)";
    const StabilityReport verdict = verdict_on("dt(u) = -advect(" + speed + ", u) + 0.5*lap(u)", run,
                                               "advect = central(2); time = imex_euler", "sin(2*pi*x/64)", rank);
    ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
    EXPECT_TRUE(verdict.is_exact);
    EXPECT_NEAR(verdict.limit.step, 0.25, 1e-3);
  }
}

/// What an implicit stage makes of the state is what is frozen there: -1e3*u^2*w takes w by Euler's method up to
/// 2/1e3/u^2.
TEST(StabilityReport, OfImplicitStagesKnowsTheirStates) {
  const StabilityReport verdict = verdict_on("field w; dt(u) = lap(u); dt(w) = -1e3*u^2*w", "  initial w = 1\n" + run,
                                             "time = imex_euler", "2 + 1e-6*sin(2*pi*x/64)");
  ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
  EXPECT_NEAR(verdict.limit.step, 2 / 4e3, 1e-3 * 2 / 4e3);
}

/// Diffusion with the eigenvalues 0.4 and 0.6 and reactions are solved for, by Newton's method and both fields at once.
TEST(StabilityReport, OfCoupledImplicitSchemesIsThatOfWhatIsExplicit) {
  const std::string reacting = "field v; dt(u) = lap(u) - 1e4*u*v\n  dt(v) = lap(v) - 1e4*(v^2 - 1) + u";
  for (const char* scheme : {"backward_euler", "crank_nicolson", "ars222", "ars443"}) {
    const StabilityReport verdict =
        verdict_on(reacting, "  initial v = 1\n" + run, std::string("implicit = all; time = ") + scheme);
    EXPECT_TRUE(verdict.is_analysed()) << scheme;
    EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::none) << scheme;
  }
  const StabilityReport verdict = verdict_on(
      "field v; dt(u) = -advect(2, u) + 0.5*lap(u) + 0.1*lap(v)\n  dt(v) = -advect(2, v) + 0.1*lap(u) + 0.5*lap(v)",
      "  initial v = 1\n" + run, "advect = central(2); implicit = all_but_advect; time = imex_euler");
  ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
  EXPECT_NEAR(verdict.limit.step, 2 * 0.4 / (2 * 2), 1e-3);
}

/// Of flows without divergence: RK4 is stable up to 2.8284 on the imaginary axis and to 2.7853 on the real one. What
/// moves the divergence alone has no limit, as a projection takes it away.
TEST(StabilityReport, OfConstraintsIsThatOfWhatFulfilsThem) {
  const auto limit_of = [](const std::string& rate, const std::string& wind) {
    return verdict_on("model m { vector u on faces; field p; dt(u) = " + rate +
                      " - grad(p); 0 = div(u) gives p }\nscheme c { time = rk4 }\nscene s : m with c {\n"
                      "  grid x = 0 .. 16, cells 16, periodic\n  grid y = 0 .. 16, cells 16, periodic\n"
                      "  initial u = " +
                      wind + "\n" + run + "\n}\n")
        .limit;
  };
  const StepLimit wind = limit_of("-advect(u, u)", "(2, 0)"), viscous = limit_of("0.5*lap(u)", "(0, 0)");
  ASSERT_EQ(wind.kind, StepLimit::Kind::limit);
  EXPECT_NEAR(wind.step, 2.8284 / 2, 1e-3);
  ASSERT_EQ(viscous.kind, StepLimit::Kind::limit);
  EXPECT_NEAR(viscous.step, 2.7853 / (0.5 * 8), 1e-3);
  const StepLimit swelling = limit_of("100*grad(div(u)) + 0.5*lap(u)", "(0, 0)");
  ASSERT_EQ(swelling.kind, StepLimit::Kind::limit);
  EXPECT_NEAR(swelling.step, 2.7853 / (0.5 * 8), 1e-3);
}

/// Where stages have the p of the step before, an error e of it is e*(1 - (R(z) - 1)/z) behind a step, R the stability
/// function: of RK4 that stays below 1 up to 2.120 on the imaginary axis, of SSP-RK3 up to its own limit.
TEST(StabilityReport, OfConstraintsEachStepIsThatOfThePressureToo) {
  const auto limit_of = [](const std::string& time, const std::string& rate, const std::string& wind) {
    return verdict_on("model m { vector u on faces; field p; dt(u) = " + rate +
                      " - grad(p); 0 = div(u) gives p each step }\nscheme c { time = " + time +
                      " }\nscene s : m with c {\n"
                      "  grid x = 0 .. 16, cells 16, periodic\n  grid y = 0 .. 16, cells 16, periodic\n"
                      "  initial u = " +
                      wind + "\n" + run + "\n}\n")
        .limit;
  };
  const StepLimit wind = limit_of("rk4", "-advect(u, u)", "(2, 0)"),
                  third = limit_of("ssp_rk3", "-advect(u, u)", "(2, 0)"),
                  viscous = limit_of("rk4", "0.5*lap(u)", "(0, 0)");
  for (const StepLimit* limit : {&wind, &third, &viscous}) ASSERT_EQ(limit->kind, StepLimit::Kind::limit);
  EXPECT_NEAR(wind.step, 2.120 / 2, 2e-3);
  EXPECT_NEAR(third.step, 1.732 / 2, 2e-3);
  EXPECT_NEAR(viscous.step, 2.7853 / (0.5 * 8), 1e-3);
}

/// A way that ends on a wall is no instability of the points beside it.
TEST(StabilityReport, IsNoLimitOfWaysThatEndOnWalls) {
  for (const char* advect : {"semi_lagrangian", "semi_lagrangian(cubic)", "maccormack"}) {
    const StabilityReport verdict = verdict_on(fmt::format(
        "model m {{ field u on faces.x; param c; dt(u) = -advect(c, u) }}\nscheme s {{ advect = {}; time = euler }}\n"
        "scene s : m with s {{\n  grid x = 0 .. 1, cells 40\n  c = 2\n  boundary u: x.low = 1, x.high = 0\n"
        "  initial u = 0\n  time 0 .. 1, step 1/20\n}}\n",
        advect));
    EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::none) << advect;
  }
}

/// What the parts make of the wave of two cells, one behind the other: 1 - 2*0.3*h by linear interpolation over a time
/// h, 1 - 16*h by diffusion.
TEST(StabilityReport, OfStepsInPartsIsThatOfTheirParts) {
  const auto carried = [](double h) { return 1 - 0.6 * h; };
  const auto spread = [](double h) { return 1 - 16 * h; };
  const std::map<std::string, std::function<double(double)>> factors{
      {"lie(advect, diffusion)", [&](double h) { return carried(h) * spread(h); }},
      {"lie(diffusion, advect)", [&](double h) { return carried(h) * spread(h); }},
      {"strang(advect, diffusion)", [&](double h) { return std::pow(carried(h / 2), 2) * spread(h); }},
      {"strang(diffusion, advect)", [&](double h) { return carried(h) * std::pow(spread(h / 2), 2); }}};
  for (const auto& [split, factor] : factors) {
    const StepLimit limit = verdict_on("dt(u) = -advect(0.3, u) + 4*lap(u)", run,
                                       "advect = semi_lagrangian; time = euler; split = " + split)
                                .limit;
    ASSERT_EQ(limit.kind, StepLimit::Kind::limit) << split;
    EXPECT_NEAR(std::abs(factor(limit.step)), 1, 2e-3) << split;
  }
}

/// Places between walls are frozen, and runs were bounded up to 1.6 times what they say; the scene's own grid is sure.
TEST(StabilityReport, RefusesBetweenWallsFromTwiceTheLimitOn) {
  StabilityReport verdict;
  verdict.limit = {.kind = StepLimit::Kind::limit, .step = 1};
  verdict.end_growth = 100;
  verdict.is_of_walls = true;
  const auto is_refused = [&](double step) {
    verdict.step = step;
    EXPECT_TRUE(verdict.is_above()) << step;
    return verdict.ruins_run();
  };
  EXPECT_FALSE(is_refused(1.9));
  EXPECT_TRUE(is_refused(2.1));
  verdict.is_of_grid = true;
  EXPECT_TRUE(is_refused(1.1));
}

}  // namespace
}  // namespace dpde::stability
