// SPDX-License-Identifier: Apache-2.0
// Reductions in equations against closed forms, and against the same equation written without them.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "../driver/driver_support.h"
#include "driver/scene/session.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

/// One field on 8 x 6 cells of [0, 2] x [0, 1], with steps 2^-steps.
std::string scene(const std::string& rhs, const std::string& initial, const std::string& time, const std::string& more,
                  int steps = 5) {
  return "model m {\n  field u\n  dt(u) = " + rhs + "\n}\nscheme c { time = " + time + " }\nscene s : m with c {\n" +
         "  grid x = 0 .. 2, cells 8, periodic\n  grid y = 0 .. 1, cells 6\n  boundary u: y.low = 0.3, y.high = "
         "gradient(0.5)\n  initial u = " +
         initial + "\n  time 0 .. 1, step 1/" + std::to_string(1 << steps) + "\n  " + more + "\n}\n";
}

/// The error against the exact solution.
double error_of(const std::string& rhs, const std::string& initial, const std::string& exact, const std::string& time,
                int steps) {
  return run_scene(scene(rhs, initial, time, "exact u = " + exact, steps), "s").l2.at("u");
}

struct ExactOfMeans {
  std::string rhs, initial, exact;
};

/// sin(pi*x) has mean 0 along x on these cells, cos(pi*y) along y.
const std::vector<ExactOfMeans> exact_solutions{
    {"-mean(u)", "1 + sin(pi*x)*y", "exp(-t) + sin(pi*x)*y"},
    {"-(u - mean(u, x))", "y^2 + sin(pi*x)*y", "y^2 + sin(pi*x)*y*exp(-t)"},
    {"-(u - mean(u, y))", "x + cos(pi*y)*x", "x + cos(pi*y)*x*exp(-t)"},
    {"-(u - mean(u, x, y))", "2 + sin(pi*x) + cos(pi*y)", "2 + (sin(pi*x) + cos(pi*y))*exp(-t)"},
    {"-integral(u)/2", "1 + cos(pi*y)", "exp(-t) + cos(pi*y)"},       // the area is 2
    {"-integral(u, x)", "y + sin(pi*x)", "y*exp(-2*t) + sin(pi*x)"},  // the length is 2
    {"-sum(u, over = y)/6", "x + cos(pi*y)", "x*exp(-t) + cos(pi*y)"},
    {"-sum(u)/48", "3 + cos(pi*y)", "3*exp(-t) + cos(pi*y)"},
    {"max(u) - u", "if(x + y > 2.5, 2, 1)", "2 - if(x + y > 2.5, 0, 1)*exp(-t)"},
    {"min(u, over = y) - u", "x + if(y < 0.2, 0, y)", "x + if(y < 0.2, 0, y)*exp(-t)"},
    {"-max(abs(u), over = x)*u", "y*if(x < 1, 1, -1)", "y*if(x < 1, 1, -1)/(1 + y*t)"},
    {"-mean(u^2)/mean(u)", "1 + 0*x", "exp(-t)"},
};

TEST(Reduction, HasTheOrderOfTheTimeScheme) {
  struct Scheme {
    std::string name;
    int order;
  };
  for (const Scheme& scheme : {Scheme{"euler", 1}, {"rk2", 2}, {"ssp_rk3", 3}, {"rk4", 4}, {"ab2", 2}}) {
    for (const ExactOfMeans& e : exact_solutions) {
      const double coarse = error_of(e.rhs, e.initial, e.exact, scheme.name, 4),
                   fine = error_of(e.rhs, e.initial, e.exact, scheme.name, 5);
      EXPECT_NEAR(std::log2(coarse / fine), scheme.order, 0.16) << e.rhs << " " << scheme.name << " " << fine;
      EXPECT_LT(fine, scheme.order == 4 ? 2e-6 : 0.1) << e.rhs << " " << scheme.name;
    }
  }
}

/// A field that is uniform along an axis equals its mean along it, wherever it is read: in differences, nested
/// differences, between cells, upwind, in functions and operators, and beyond walls.
TEST(Reduction, IsReadAtNeighboursAndWalls) {
  const std::string functions =
      "function wave(a) = sin(a)\noperator wide(a) order 2 = (a[0, +2] - a[0, -2])/(4*hy)\noperator jump(a) order 2 = "
      "wide(wide(a))\n";
  const std::vector<std::string> equations{"-M*dy(M)",
                                           "0.02*lap(M)",
                                           "0.02*dy((1 + M^2)*dy(M))",
                                           "0.02*dy(dy(M))",
                                           "-0.1*advect((1, M), M)",
                                           "-0.1*dy(wave(M)*M)",
                                           "-0.01*dy(dy(dy(M)))",
                                           "-0.1*wide(M^2)",
                                           "0.01*jump(M)",
                                           "-0.1*dy(M*mean(M)) + 0.1*mean(M*dy(M))",
                                           "-0.1*M*dy(y*M) + 0.1*dx(M)"};
  for (const std::string scheme : {"rk2; dx = central(2)", "rk4; dx = central(4); lap = central(4)",
                                   "rk2; advect = upwind(1)", "euler; advect = upwind(3)"}) {
    for (const std::string& equation : equations) {
      const auto with = [&](const std::string& m) {
        std::string rhs = equation;
        for (std::size_t at = 0; (at = rhs.find('M', at)) != std::string::npos; at += m.size()) rhs.replace(at, 1, m);
        return run_scene(functions + scene(rhs, "1 + y*(1 - y)", scheme, ""), "s").state.at("u");
      };
      const std::vector<double> mean = with("mean(u, x)"), plain = with("u");
      ASSERT_EQ(mean.size(), 48u);
      EXPECT_GT(std::abs(plain[0] - (1 + 11. / 144)) + std::abs(plain[47] - (1 + 11. / 144)), 1e-4) << equation;
      for (std::size_t i = 0; i < plain.size(); ++i)
        ASSERT_NEAR(mean[i], plain[i], 1e-13) << equation << " " << scheme << " at " << i;
    }
  }
}

/// Also on faces: each mean is over its operand's points and has their placement.
TEST(Reduction, OfStaggeredFields) {
  const std::string begin = "model m {\n  vector u on faces\n  field eta\n";
  const std::string rest =
      "}\nscene s : m {\n  grid x = 0 .. 2, cells 6\n  grid y = 0 .. 1, cells 5, periodic\n  boundary u: x = (0.2, 0)\n"
      "  boundary eta: x = zero_gradient\n  initial u = (0.2 + sin(pi*x/2), x)\n  initial eta = cos(pi*x/2)\n  time 0 "
      ".. 1/4, step 1/64\n}\n";
  const auto run = [&](const std::string& ux, const std::string& eta) {
    return run_scene(begin + "  dt(eta) = -dx(" + ux + ") - 0.1*dx(interpolate(" + ux + ")^2)\n  dt(u.x) = -dx(" + eta +
                         ") - 0.1*" + ux + "*dx(" + ux + ")\n" + "  dt(u.y) = -0.1*interpolate(" + ux + ")\n" + rest,
                     "s")
        .state;
  };
  const auto mean = run("mean(u.x, y)", "mean(eta, over = y)"), plain = run("u.x", "eta");
  for (const char* field : {"u.x", "u.y", "eta"}) {
    for (std::size_t i = 0; i < 30; ++i)
      ASSERT_NEAR(mean.at(field)[i], plain.at(field)[i], 1e-13) << field << " at " << i;
  }
}

TEST(Reduction, InEventsAndObservables) {
  const std::string text = scene("1 + x", "x", "rk4",
                                 "after step: u = u - mean(u)\n  observe left = mean(u)\n  observe peak = max(u) - "
                                 "min(u)\n  observe spread = mean((u - mean(u, x))^2)");
  const SceneResult result = run_scene(text, "s");
  double sum = 0, squares = 0, low = 1e9, high = -1e9;
  for (const double v : result.state.at("u")) {
    sum += v;
    squares += v * v;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  EXPECT_NEAR(sum, 0, 1e-12);
  EXPECT_NEAR(high - low, 2 * 1.75, 1e-12);  // x from 1/8 to 15/8, twice: from the start and from the slope
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.backend = driver::Backend::jit;
  DiagnosticSink sink;
  const auto session = driver::Session::open(source, compiled(source, options), {}, sink);
  ASSERT_TRUE(session);
  session->rollout().run();
  std::map<std::string, double> observed;
  for (const auto& [name, value] : session->observe(1, session->rollout().final_states())) observed[name] = value;
  EXPECT_NEAR(observed.at("left"), 0, 1e-12);
  EXPECT_NEAR(observed.at("peak"), high - low, 1e-12);
  EXPECT_NEAR(observed.at("spread"), squares / 48, 1e-12);  // the mean along x is 0
}

/// Dot products, Taylor slope and Hessian.
TEST(Reduction, DerivativesAreCertified) {
  const std::vector<std::string> equations{
      "-a*(u - mean(u, x)) + 0.01*lap(u)",
      "0.02*lap(u) + a*(1 - mean(u^2))*u - mean(u, x)*dy(mean(u, x))",
      "-a*u*max(u)/(1 + sum(u)^2) + 0.1*min(u, over = y)*dx(u)",
      "-advect((mean(u), max(u, over = x)), u) + a*integral(sin(u), y)",
      "a*dy(u*mean((u - mean(u))^2, x)) - 0.1*max(abs(dx(u)))*u",
  };
  for (const std::string& equation : equations) {
    const std::string text = "model m {\n  field u\n  param a\n  dt(u) = " + equation +
                             "\n}\nscene s : m {\n  grid x = 0 .. 2, cells 5, periodic\n  grid y = 0 .. 1, cells 4\n  "
                             "boundary u: y.low = 0.3*a, y.high = zero_gradient\n"
                             "  a = 0.4\n  initial u = sin(pi*x)*y + 0.3*x^2*y + y^2\n  time 0 .. 1/4, step 1/32\n}\n"
                             "task t : s {\n  unknown initial u\n  unknown a\n  minimise mean((u - mean(u, y))^2) + "
                             "0.1*max(u)*1\n  minimise mean(u^2) over time\n}\n";
    SCOPED_TRACE(equation);
    const auto certificate = certificate_of(text, true);
    ASSERT_TRUE(certificate && certificate->second);
    EXPECT_TRUE(certificate->passed());
    EXPECT_LT(certificate->worst(), 1e-12);
    EXPECT_NEAR(certificate->slope.value_or(0), 2, 0.05);
    EXPECT_NEAR(certificate->second->slope.value_or(0), 3, 0.1);  // the extremes stay in their cells
  }
}

}  // namespace
}  // namespace dpde::testing
