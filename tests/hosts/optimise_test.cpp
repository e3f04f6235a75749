// SPDX-License-Identifier: Apache-2.0
// The optimiser in hosts: what `dpde optimize` finds, to the last bit; progress, and stops of optimisers and of
// gradients.
#include <cmath>

#include "dpde/runtime/npy.h"
#include "host_support.h"

namespace dpde::testing {
namespace {

const char* recovery = R"(model heat { field u; coefficient kappa; param s; dt(u) = div(kappa*grad(u)) + s }
scheme e { time = euler }
scene plate : heat with e {
  grid x = 0 .. 1, cells 16
  boundary u: x.low = 1, x.high = zero_gradient
  kappa = 0.5 + 0.2*sin(3*x)
  s = 0.5
  initial u = s*sin(3*x)
  time 0 .. 0.05, step 0.001
}
task recover : plate {
  data v = u from scene plate at t = 0.01, 0.03, 0.05
  unknown s from 0.3
  unknown kappa from 0.5 in 0.4 .. 0.65
  unknown initial u from 0.4*sin(3*x)
  minimise mean((u - v)^2) at t = 0.01, 0.03, 0.05
  minimise 1e-4*mean(dx(kappa)^2)
  using OPTIMISER
}
task factor : plate {
  data v = u from scene plate at t = 0.05
  unknown s from 0.3
  minimise mean((u - v)^2)
  using OPTIMISER
}
)";

struct Case {
  std::string name, file, task, optimiser;
  Settings set;
};
/// No parameter is 0 or 1: the command leaves those out of the equations, a host may set them later.
const Case cases[] = {
    {"ParameterAndState", "heat/heat.dpde", "conductivity", "", {{"cells", "24"}}},
    {"DataOfAnotherScene", "heat/heat.dpde", "recover", "", {{"cells", "32"}}},
    {"InitialState", "burgers_1d/burgers.dpde", "recover", "", {{"cells", "32"}}},
    {"BoundedControl", "heat/steer.dpde", "steer", "", {{"cells", "16"}}},
    {"ControlField", "../tests/golden/control_field/in.dpde", "t", "", {}},
    {"CoefficientInSpace", "shallow_water/shallow_water.dpde", "bank", "", {{"cells", "12"}}},
    {"Velocity", "wave/wave.dpde", "recover", "", {{"cells", "12"}}},
    {"Places", "advection_diffusion/leak.dpde", "find", "", {{"cells.x", "24"}, {"cells.y", "12"}, {"u", "1.1"}}},
    {"SinglePrecision", "heat/heat.dpde", "conductivity", "", {{"cells", "24"}, {"real", "f32"}}},
    {"BoundsAndFormulas", "", "recover", "lbfgs(), iterations 25", {}},
    {"FormulaOfTheStart", "", "factor", "lbfgs(), iterations 25", {}},
    {"GradientDescent", "", "recover", "gradient_descent(rate = 0.1), iterations 12", {}},
    {"Adam", "", "recover", "adam(rate = 0.02), iterations 12", {}},
    {"Newton", "", "recover", "newton_cg(hessian = full), iterations 6", {}},
    {"GaussNewton", "", "recover", "newton_cg(hessian = gauss_newton), iterations 6", {}},
};

std::string with(const std::string& optimiser) {
  std::string text = recovery;
  for (std::size_t at = text.find("OPTIMISER"); at != std::string::npos; at = text.find("OPTIMISER"))
    text.replace(at, 9, optimiser);
  return text;
}

class Optimise : public InFolder, public ::testing::WithParamInterface<int> {};

TEST_P(Optimise, IsTheCommandToTheLastBit) {
  const Case& c = cases[GetParam()];
  const std::string file = c.file.empty() ? write("recovery.dpde", with(c.optimiser)) : example(c.file);
  Simulation sim = compile_file(file, {.name = c.task, .set = c.set});
  std::vector<OptimiserProgress> seen;
  const Optimised found = sim.optimise([&](const OptimiserProgress& now) {
    seen.push_back(now);
    return true;
  });
  const Json json = dpde("optimize " + file + " " + c.task + text_of(c.set) + " --threads 1 --quiet --out " +
                         (folder_ / "out").string());
  EXPECT_EQ(found.losses, json["loss"].get<std::vector<double>>());
  EXPECT_EQ(found.iterations, json["iterations"]);
  EXPECT_EQ(found.evaluations, json["evaluations"]);
  EXPECT_EQ(found.hessian_products, json["hessian_products"]);
  EXPECT_EQ(describe(found.reason), json["reason"]);
  EXPECT_EQ(found.losses.size(), static_cast<std::size_t>(found.iterations) + 1);
  EXPECT_LT(found.losses.back(), found.losses.front());
  for (const std::string& unknown : sim.unknowns()) {
    const Json& from = json["unknowns"][unknown];
    std::vector<double> expected;
    if (from.contains("value")) expected = {from["value"]};
    if (from.contains("values")) expected = from["values"].get<std::vector<double>>();
    for (const std::string& name : {unknown + "_initial.npy", unknown + ".npy"}) {
      if (std::filesystem::exists(folder_ / "out" / name))
        expected = read_npy((folder_ / "out" / name).string()).values;
    }
    if (c.set.contains("real")) {
      for (double& value : expected)
        value = expected.size() > 1 ? static_cast<float>(value) : value;  // what a field holds
    }
    EXPECT_EQ(sim.value_of(unknown), expected) << unknown;
  }
  ASSERT_EQ(seen.size(), found.losses.size());
  for (std::size_t k = 0; k < seen.size(); ++k) {
    EXPECT_EQ(seen[k].iteration, static_cast<int>(k));
    EXPECT_EQ(seen[k].loss, found.losses[k]);
  }
  EXPECT_EQ(sim.loss(), found.loss);
}

INSTANTIATE_TEST_SUITE_P(Tasks, Optimise, ::testing::Range(0, static_cast<int>(std::size(cases))),
                         [](const auto& info) { return cases[info.param].name; });

TEST(Optimiser, StopsWhenToldAndGoesOn) {
  const std::string text = with("lbfgs(), iterations 10");
  Simulation sim = compile_text(text, {.name = "recover"}), whole = compile_text(text, {.name = "recover"});
  const Optimised all = whole.optimise();
  const Optimised some = sim.optimise([](const OptimiserProgress& now) { return now.iteration < 3; });
  EXPECT_EQ(some.reason, StopReason::observer);
  EXPECT_EQ(some.iterations, 3);
  EXPECT_TRUE(std::equal(some.losses.begin(), some.losses.end(), all.losses.begin()));
  EXPECT_EQ(some.loss, all.losses[3]);
  EXPECT_EQ(sim.loss(), some.loss);
  const Optimised more = sim.optimise({}, 2);  // from there, and not as many as the task says
  EXPECT_EQ(more.iterations, 2);
  EXPECT_EQ(more.losses[0], some.loss);
  EXPECT_LT(more.loss, some.loss);
}

TEST(Optimiser, TheFlagStopsItInAGradient) {
  std::atomic<bool> stop{false};
  for (const std::string optimiser :
       {"lbfgs(), iterations 10", "adam(rate = 0.02), iterations 10", "newton_cg(hessian = full), iterations 10"}) {
    stop = false;
    Simulation sim = compile_text(with(optimiser), {.name = "recover", .stop = &stop});
    const Optimised found = sim.optimise([&](const OptimiserProgress& now) {
      stop = now.iteration == 2;
      return true;
    });
    EXPECT_EQ(found.reason, StopReason::observer);
    EXPECT_EQ(found.iterations, found.losses.size() == 4 ? 3 : 2) << "an update that was not evaluated may be counted";
    stop = false;
    EXPECT_EQ(sim.loss(), found.loss) << optimiser;
  }
}

TEST(Optimiser, NeedsATaskAndSecondDerivativesForNewton) {
  Simulation scene = compile_text(with("lbfgs()"), {.name = "plate"});
  EXPECT_THROW(scene.optimise(), Error);
}

TEST(WatchedGradient, CountsItsStepsAndStops) {
  Simulation sim = compile_text(with("lbfgs()"), {.name = "recover", .second_order = true});
  const double loss = sim.gradient();
  const std::vector<double> bars(sim.gradient_vector().begin(), sim.gradient_vector().end());
  std::vector<GradientProgress> seen;
  sim.watch_gradients(
      [&](const GradientProgress& now) {
        seen.push_back(now);
        return true;
      },
      20);
  EXPECT_EQ(sim.gradient(), loss);
  ASSERT_EQ(seen.size(), 5u);  // 50 steps forward and back
  for (std::size_t i = 0; i < seen.size(); ++i) {
    EXPECT_EQ(seen[i].done, 20 * (static_cast<int>(i) + 1));
    EXPECT_EQ(seen[i].total, 100);
    EXPECT_NEAR(seen[i].time, 0.001 * std::min(seen[i].done, 100 - seen[i].done), 1e-12);
  }
  seen.clear();
  const std::vector<double> v = random_values(bars.size(), 1);
  const std::vector<double> product = sim.hessian_vector(v);
  EXPECT_EQ(seen.size(), 5u);
  for (const int at : {20, 60, 100}) {
    sim.watch_gradients([&](const GradientProgress& now) { return now.done != at; }, 20);
    EXPECT_TRUE(std::isnan(sim.gradient())) << at;
    for (const double value : sim.hessian_vector(v)) EXPECT_TRUE(std::isnan(value)) << at;
    const Optimised found = sim.optimise();
    EXPECT_EQ(found.reason, StopReason::observer);
    EXPECT_EQ(found.evaluations, 1);
  }
  sim.watch_gradients({});
  EXPECT_EQ(sim.gradient(), loss);
  EXPECT_TRUE(std::equal(bars.begin(), bars.end(), sim.gradient_vector().begin()));
  EXPECT_EQ(sim.hessian_vector(v), product);
}

/// With few slots steps are made more than once.
TEST(WatchedGradient, CountsWhatIsComputedAgain) {
  const std::string text = with("lbfgs()");
  for (const int slots : {1, 2, 5, 0}) {
    Simulation sim = compile_text(text, {.name = "recover", .slots = slots});
    GradientProgress last{0, 0, 1};
    std::int64_t calls = 0;
    sim.watch_gradients(
        [&](const GradientProgress& now) {
          ++calls;
          EXPECT_EQ(now.done, last.done + 1);
          last = now;
          return true;
        },
        1);
    sim.gradient();
    EXPECT_EQ(last.done, last.total) << slots;
    EXPECT_EQ(calls, last.total);
    EXPECT_EQ(last.time, 0);
    if (slots == 1) {
      EXPECT_EQ(last.total, 49 * 50 / 2 + 1 + 50)
          << "step n is reversed behind n steps from the start, the last one is made once more";
    }
    if (slots == 0) {
      EXPECT_EQ(last.total, 100);
    }
  }
}

}  // namespace
}  // namespace dpde::testing
