// SPDX-License-Identifier: Apache-2.0
// Unknown coefficient fields, and parameters in formulas of coefficients.
#include <cmath>
#include <cstring>
#include <numbers>

#include "command_support.h"

namespace dpde::testing {
namespace {

class Unknowns : public Command {
 protected:
  /// The values of a one-dimensional array of doubles.
  std::vector<double> array(const std::string& name) const {
    const std::string bytes = content(path(name));
    std::size_t header = 0;
    EXPECT_GT(bytes.size(), 10u) << name;
    if (bytes.size() > 10)
      header = 10 + static_cast<unsigned char>(bytes[8]) + 256u * static_cast<unsigned char>(bytes[9]);
    std::vector<double> values((bytes.size() - header) / sizeof(double));
    std::memcpy(values.data(), bytes.data() + header, values.size() * sizeof(double));
    return values;
  }
};

const char* source_text = R"(
model heated { field u; coefficient q; dt(u) = q }
scheme e { time = euler }
scene s : heated with e {
  grid x = 0 .. 1, cells 5, periodic
  q = 1 + x
  initial u = x^2
  time 0 .. 0.5, step 0.1
}
task t : s { unknown q from 2 - x
  minimise 0.5*integral(u^2) }
)";

/// u(T) = u0 + T q, so dJ/dq = h T u(T).
TEST_F(Unknowns, CoefficientHasTheGradientOfTheClosedForm) {
  write("source.dpde", source_text);
  const Outcome run = dpde("gradient source.dpde t --json --out o");
  ASSERT_EQ(run.status, 0) << run.err;
  const std::vector<double> gradient = array("o/gradient_q.npy");
  ASSERT_EQ(gradient.size(), 5u);
  for (int i = 0; i < 5; ++i) {
    const double x = (i + 0.5) / 5;
    EXPECT_NEAR(gradient[static_cast<std::size_t>(i)], 0.2 * 0.5 * (x * x + 0.5 * (2 - x)), 1e-15);
  }
}

const char* heat_text = R"(
model heat { field u; coefficient kappa; param c; dt(u) = c*div(kappa*grad(u)) }
scheme e { time = rk4 }
scene s : heat with e {
  grid x = 0 .. 1, cells 12
  boundary u: x.low = 1, x.high = zero_gradient
  kappa = 0.5
  c = 1
  initial u = sin(3*x)
  time 0 .. 0.05, step 0.0025
}
task field : s { unknown kappa
  minimise mean(u^2) over time
  minimise 1e-3*mean(dx(kappa)^2 + kappa^2) }
task number : s { unknown c
  minimise mean(u^2) over time }
task only : s { unknown kappa
  minimise mean(u^2) over time }
)";

/// Scaling kappa as a whole is scaling c: c dJ/dc = sum of kappa dJ/dkappa. dJ/dc is computed by another method.
TEST_F(Unknowns, CoefficientAgreesWithAFactorOfIt) {
  write("heat.dpde", heat_text);
  const Outcome number = dpde("gradient heat.dpde number --json"),
                field = dpde("gradient heat.dpde only --json --out o");
  ASSERT_EQ(number.status + field.status, 0) << number.err << field.err;
  double sum = 0;
  for (const double value : array("o/gradient_kappa.npy")) sum += 0.5 * value;
  const double expected = number.json()["gradient"]["c"]["value"];
  EXPECT_NEAR(sum, expected, 1e-13 * std::abs(expected));
}

TEST_F(Unknowns, CoefficientIsTheSameWithLittleMemory) {
  write("heat.dpde", heat_text);
  const Outcome all = dpde("gradient heat.dpde field --json"),
                few = dpde("gradient heat.dpde field --json --memory 2K");
  ASSERT_EQ(all.status + few.status, 0) << all.err << few.err;
  EXPECT_EQ(few.json()["gradient"], all.json()["gradient"]);
  EXPECT_GT(few.json()["checkpoints"]["recomputed_steps"], 0);
}

TEST_F(Unknowns, CoefficientsAreCertified) {
  write("heat.dpde", heat_text);
  write("plate.dpde", R"(
model heat { field u; coefficient kappa; param p; dt(u) = div(kappa*grad(u)) }
scene s : heat {
  grid x = 0 .. 1, cells 6
  grid y = 0 .. 1, cells 5, periodic
  boundary u: x = 1
  kappa = 0.3 + p*x*y
  p = 0.2
  initial u = p*sin(3*x)*cos(2*pi*y)
  time 0 .. 0.02, step 0.002
}
task field : s { unknown kappa from 0.4 + 0.1*x; unknown initial u
  minimise mean(u^2) + 1e-3*mean(dx(kappa)^2 + dy(kappa)^2) }
task formula : s { unknown p
  minimise mean(u^2) over time }
)");
  for (const char* task : {"heat.dpde field", "plate.dpde field", "plate.dpde formula"}) {
    const Outcome run = dpde(std::string("verify --json ") + task);
    EXPECT_EQ(run.status, 0) << task << run.out << run.err;
  }
}

/// kappa = c x: the parameter in a coefficient's formula, against differences of the loss.
TEST_F(Unknowns, ParameterOfACoefficientFormula) {
  write("source.dpde", R"(
model heated { field u; coefficient q; param a; dt(u) = q }
scheme e { time = euler }
scene s : heated with e {
  grid x = 0 .. 1, cells 4, periodic
  a = 3
  q = exp(a*x)
  initial u = a*x
  time 0 .. 0.5, step 0.1
}
task t : s { unknown a
  minimise 0.5*integral(u^2) }
)");
  const Outcome run = dpde("gradient source.dpde t --json");
  ASSERT_EQ(run.status, 0) << run.err;
  double expected = 0;  // u(T) = a x + T exp(a x)
  for (const double x : {0.125, 0.375, 0.625, 0.875}) {
    expected += 0.25 * (3 * x + 0.5 * std::exp(3 * x)) * (x + 0.5 * x * std::exp(3 * x));
  }
  EXPECT_NEAR(run.json()["gradient"]["a"]["value"], expected, 1e-13 * expected);
}

TEST_F(Unknowns, CoefficientIsRecoveredAndWritten) {
  std::string text = heat_text;
  text += R"(
scene truth : heat with e {
  grid x = 0 .. 1, cells 12
  boundary u: x.low = 1, x.high = zero_gradient
  kappa = 0.5 + 0.2*sin(3*x)
  c = 1
  initial u = sin(3*x)
  time 0 .. 0.05, step 0.0025
}
task recover : s {
  data v = u from scene truth at t = 0.01, 0.03, 0.05
  unknown kappa from 0.5
  minimise mean((u - v)^2) at t = 0.01, 0.03, 0.05
  using lbfgs(), iterations 60
}
)";
  write("heat.dpde", text);
  const Outcome run = dpde("optimize heat.dpde recover --json --out o");
  ASSERT_EQ(run.status, 0) << run.err;
  const std::vector<double> losses = run.json()["loss"].get<std::vector<double>>();
  EXPECT_LT(losses.back(), 1e-6 * losses.front());
  EXPECT_EQ(array("o/kappa.npy").size(), 12u);
}

/// The data fit k = 0.3 best, but k is bounded by 0.26.
TEST_F(Unknowns, StayWithinTheirBounds) {
  for (const std::string optimiser : {"lbfgs()", "gradient_descent(rate = 0.5)", "newton_cg()"}) {
    std::string text = rod_text;
    text.replace(text.find("unknown k from 0.25"), 19, "unknown k from 0.25 in 0.1 .. 0.26");
    text.replace(text.find("lbfgs()"), 7, optimiser);
    write("rod.dpde", text);
    const Outcome run = dpde("optimize rod.dpde find --json");
    ASSERT_EQ(run.status, 0) << optimiser << run.err;
    EXPECT_EQ(run.json()["unknowns"]["k"]["value"], 0.26) << optimiser;
  }
}

/// mixed(a, -1, 0) is invalid from a = 8 on: searches that shorten their steps stay below, others end with a message.
TEST_F(Unknowns, LeaveConditionsAtWallsWhatTheyAre) {
  const std::string text =
      "model m { field u; param a; dt(u) = 0.01*lap(u) + 0*a }\nscene s : m {\n grid x = 0 .. 1, cells 4\n boundary u: "
      "x.low = mixed(a, -1, 0), x.high = 0\n"
      " initial u = 1\n time 0 .. 1/4, step 1/64\n}\ntask t : s {\n unknown a from 7\n minimise 100*mean((a/10 - 1)^2) "
      "+ mean(u^2)\n using OPTIMISER, iterations 20\n}\n";
  const auto with = [&](const std::string& optimiser) {
    std::string changed = text;
    changed.replace(changed.find("OPTIMISER"), 9, optimiser);
    write("wall.dpde", changed);
    return dpde("optimize wall.dpde t --json");
  };
  const Outcome fixed = with("gradient_descent(rate = 0.4)");
  EXPECT_EQ(fixed.codes(), std::vector<std::string>{"E0433"}) << fixed.err;
  EXPECT_NE(fixed.err.find("mixed("), std::string::npos) << fixed.err;
  EXPECT_NE(fixed.err.find("seek within bounds"), std::string::npos) << fixed.err;
  const Outcome shortened = with("lbfgs()");
  EXPECT_LT(shortened.json()["unknowns"]["a"]["value"].get<double>(), 8) << shortened.err;
}

/// The same if both weights vanish: before certification, or when the search gets there.
TEST_F(Unknowns, AreNotSoughtWhereAConditionSaysNothing) {
  const auto text = [](const std::string& weight, const std::string& from, const std::string& optimiser) {
    return "model m { field u; param a; dt(u) = 0.01*lap(u) }\nscene s : m {\n grid x = 0 .. 1, cells 8\n boundary u: "
           "x.low = mixed(" +
           weight +
           ", 0, a), x.high = 0\n a = 1\n initial u = 1\n time 0 .. 1, step 1/16\n}\ntask t : s {\n unknown a " + from +
           "\n minimise mean(u^2) + (a + 1)^2\n using " + optimiser + "\n}\n";
  };
  const auto refused = [&](const std::string& command, const std::string& place, const std::string& when) {
    const Outcome outcome = dpde(command);
    const std::string wanted = place + ": error[E0424]: mixed(0, 0, ...) is no condition for u at x.low" + when + "\n";
    EXPECT_EQ(outcome.err.find(wanted), 0u) << command << "\n" << outcome.err;
    return outcome.out;
  };
  write("start.dpde", text("a", "from 0", "lbfgs()"));
  write("time.dpde", text("a*sin(t)", "from 2", "lbfgs()"));
  for (const std::string verb : {"gradient", "verify", "optimize"}) {
    EXPECT_EQ(refused(verb + " start.dpde t", "start.dpde:4:22", " where task t begins").find("ertified"),
              std::string::npos);
    EXPECT_EQ(refused(verb + " time.dpde t", "time.dpde:4:22", " at t = 0").find("ertified"), std::string::npos);
  }
  refused("run time.dpde s", "time.dpde:4:22", " at t = 0");
  write("bound.dpde", text("a", "from 1 in 0 .. 2", "gradient_descent(rate = 0.2)"));
  refused("optimize bound.dpde t", "bound.dpde:4:28", " after 2 iterations");
}

/// A setting has precedence over the file, also for the initial value of an unknown.
TEST_F(Unknowns, StartWhereTheyAreSet) {
  write("k.dpde",
        "model m { field u; param k; dt(u) = -k*u }\nscene s : m {\n  grid x = 0 .. 1, cells 4, periodic\n  k = 0.1\n  "
        "initial u = 1\n  time 0 .. 1, step 0.1\n}\n"
        "task q : s { unknown k from 0.2 in 0 .. 6; minimise mean(u^2); using lbfgs() }\n");
  const auto loss = [&](const std::string& set) {
    return double(dpde("gradient k.dpde q --json --set time=rk4 " + set).json()["loss"]);
  };
  EXPECT_NEAR(loss(""), std::exp(-0.4), 1e-6);
  EXPECT_NEAR(loss("--set k=0.7"), std::exp(-1.4), 1e-6);
  EXPECT_EQ(dpde("gradient k.dpde q --set k=7").status, 2) << "beyond its bounds";
}

/// Positions that leave the grid with time, or are outside at the start of a task, are reported before the run.
TEST_F(Unknowns, PlacesAreOnTheGridAtAllTimesThatAreKnown) {
  const auto check = [&](const std::string& place, const std::string& grid, const std::string& task) {
    write("p.dpde", "model m { field u; param xs; dt(u) = inject(1, at = " + place +
                        ") - 0.1*u }\nscene s : m {\n  grid x = 0 .. 1, cells 8" + grid +
                        "\n  xs = 0.3\n  initial u = 0\n" + (grid.empty() ? "  boundary u: x = zero_gradient\n" : "") +
                        "  time 0 .. 1, step 0.125\n}\n"
                        "task q : s { unknown xs" +
                        task + "; minimise mean(u^2); using lbfgs() }\n");
    const Outcome outcome = dpde("check p.dpde --all q");
    return outcome.status == 0 ? "" : outcome.err;
  };
  EXPECT_EQ(check("xs + 0.7*t", "", ""), "");
  EXPECT_NE(check("xs + t", "", "").find("x = 1.05 at t = 0.75"), std::string::npos);
  EXPECT_EQ(check("xs + t", ", periodic", ""), "");
  EXPECT_EQ(check("min(xs + t, 1)", "", ""), "");
  EXPECT_NE(check("xs", "", " from 2").find("x = 2 where task q begins"), std::string::npos);
  EXPECT_EQ(check("xs", "", " from 0.9"), "");
}

}  // namespace
}  // namespace dpde::testing
