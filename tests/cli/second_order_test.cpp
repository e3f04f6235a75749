// SPDX-License-Identifier: Apache-2.0
// Reports of verify on second derivatives, and newton_cg on an inverse problem.
#include "command_support.h"

namespace dpde::testing {
namespace {

using SecondOrderCommand = Command;

const char* burgers_text = R"(
model burgers { field u; coefficient q; param nu; dt(u) = -advect(u, u) + nu*lap(u) + q }
scheme smooth { advect = central(2); time = rk2 }
scheme bent { advect = upwind(1); time = euler }
scene wave : burgers with smooth {
  grid x = 0 .. 1, cells 20
  boundary u: x.low = 0.2, x.high = zero_gradient
  nu = 0.02
  q = x
  initial u = sin(3*x)
  time 0 .. 0.2, step 0.02
}
task all : wave { unknown nu; unknown q; unknown initial u
  minimise mean((u - 0.5)^4) over time
  minimise 1e-2*nu^2 + 1e-3*mean(dx(q)^2) }
task kinks : wave with bent { unknown nu; unknown initial u
  minimise mean(u^2) }
)";

TEST_F(SecondOrderCommand, IsCertified) {
  write("burgers.dpde", burgers_text);
  const Outcome smooth = dpde("verify burgers.dpde all --json");
  ASSERT_EQ(smooth.status, 0) << smooth.out << smooth.err;
  EXPECT_NEAR(smooth.json()["taylor"]["slope_second"], 3.0, 0.1);
  EXPECT_LE(smooth.json()["hessian"]["max_relative_error"], 1e-10);
  EXPECT_GE(smooth.json()["hessian"]["cases"], 9);
  const Outcome kinks = dpde("verify burgers.dpde kinks --json");
  EXPECT_EQ(kinks.status, 0) << kinks.out << kinks.err;
  EXPECT_EQ(kinks.json()["hessian"]["has_kinks"], true);
  EXPECT_LE(kinks.json()["hessian"]["max_relative_error"], 1e-10);
}

/// The halves at both ends are switches by t, which no unknown moves.
TEST_F(SecondOrderCommand, IsCertifiedOverTime) {
  const auto verified = [&](const std::string& rate, const std::string& over) {
    write("s.dpde",
          "model m { field u; param k = 0.7; dt(u) = " + rate +
              " + 0.01*lap(u) }\nscheme q { time = rk4 }\nscene s : m with q {\n"
              "  grid x = 0 .. 1, cells 16, periodic\n  initial u = 1 + 0.5*sin(2*pi*x)\n"
              "  time 0 .. 0.2, step 0.01\n}\ntask t : s { unknown k; unknown initial u\n  minimise mean(u^2), " +
              over + " over time }\n");
    return dpde("verify s.dpde t").out;
  };
  for (const char* over : {"mean", "sum", "integral"}) {
    const std::string text = verified("-k*u^2", over);
    EXPECT_NE(text.find("Hessian: certified"), std::string::npos) << over << text;
  }
  const std::string bent = verified("-k*abs(u - 1)", "integral");
  EXPECT_NE(bent.find("the programs have kinks"), std::string::npos) << bent;
}

std::string recovery(const std::string& optimiser) {
  return R"(
model heat { field u; coefficient kappa; dt(u) = div(kappa*grad(u)) }
scheme e { time = euler }
scene s : heat with e {
  grid x = 0 .. 1, cells 16
  boundary u: x.low = 1, x.high = zero_gradient
  kappa = 0.5
  initial u = sin(3*x)
  time 0 .. 0.05, step 0.001
}
scene truth : heat with e {
  grid x = 0 .. 1, cells 16
  boundary u: x.low = 1, x.high = zero_gradient
  kappa = 0.5 + 0.2*sin(3*x)
  initial u = sin(3*x)
  time 0 .. 0.05, step 0.001
}
task recover : s {
  data v = u from scene truth at t = 0.01, 0.03, 0.05
  unknown kappa from 0.5
  minimise mean((u - v)^2) at t = 0.01, 0.03, 0.05
  using )" +
         optimiser + "\n}\n";
}

/// The solution fits the data exactly, so both matrices work; L-BFGS is far from it after many more iterations.
TEST_F(SecondOrderCommand, NewtonNeedsFewIterations) {
  write("lbfgs.dpde", recovery("lbfgs(), iterations 60"));
  const Outcome first = dpde("optimize lbfgs.dpde --json");
  ASSERT_EQ(first.status, 0) << first.err;
  const std::vector<double> slow = first.json()["loss"].get<std::vector<double>>();
  for (const std::string hessian : {"full", "gauss_newton"}) {
    write("newton.dpde", recovery("newton_cg(hessian = " + hessian + "), iterations 15"));
    const Outcome run = dpde("optimize newton.dpde --json");
    ASSERT_EQ(run.status, 0) << run.err;
    const std::vector<double> losses = run.json()["loss"].get<std::vector<double>>();
    EXPECT_LT(losses.back(), slow.back()) << hessian;
    EXPECT_LE(losses.size(), 16u);
    EXPECT_GT(run.json()["hessian_products"], 0);
  }
}

TEST_F(SecondOrderCommand, GaussNewtonOfSomethingElseIsAnError) {
  std::string text = rod_text;
  text.replace(text.find("mean(u^2) at t = 1"), 18, "mean(exp(u)) at t = 1");
  text.replace(text.find("lbfgs()"), 7, "newton_cg(hessian = gauss_newton)");
  write("rod.dpde", text);
  const Outcome run = dpde("optimize rod.dpde find --json");
  EXPECT_EQ(run.status, 2);
  EXPECT_EQ(run.codes(), std::vector<std::string>{"E0608"});
  write("rod.dpde", text.replace(text.find("= gauss_newton"), 14, "= some"));
  EXPECT_EQ(dpde("optimize rod.dpde find --json").codes(), std::vector<std::string>{"E0707"});
}

}  // namespace
}  // namespace dpde::testing
