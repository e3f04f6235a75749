// SPDX-License-Identifier: Apache-2.0
// Scenes with networks in hosts: gradients by the weights against differences, the same on every back end.
#include <cmath>

#include "host_support.h"

namespace dpde::testing {
namespace {

const std::string in_formulas = "sin(2*pi*x)*corrector(x - 0.5) + corrector(cos(2*pi*x))";

std::string scene(const std::string& precision, const std::string& initial = "sin(2*pi*x)") {
  return R"(
network corrector(u) { initial he, seed 3; conv 5, 3; tanh; conv out, 3, gain = 0.2 }
model m { field u; param nu; dt(u) = -u*dx(u) + nu*lap(u) }
scheme s { time = rk2; networks = )" +
         precision + R"( }
scene r : m with s {
  grid x = 0 .. 1, cells 16, periodic
  nu = 0.02
  initial u = )" +
         initial + R"(
  time 0 .. 0.2, step 0.02
  after step: u += corrector(u)
}
task t : r { learn corrector; unknown nu; minimise mean((u - 0.5)^2) over time })";
}

void expect_differences(const std::string& text) {
  Simulation sim = compile_text(text, {.name = "t"});
  const std::vector<double> x = sim.unknown_values(), v = random_values(x.size(), 5);
  EXPECT_EQ(sim.weights("corrector").size(), 5u * 3 + 5 + 5 * 3 + 1);
  EXPECT_EQ(sim.gradient_of("corrector").size(), 36u);
  sim.gradient();
  const double slope = dot(sim.gradient_vector(), v), h = 2e-4;
  double difference = 0;
  for (const auto& [steps, weight] : {std::pair{1, 8.0}, {-1, -8.0}, {2, -1.0}, {-2, 1.0}}) {
    std::vector<double> at = x;
    for (std::size_t i = 0; i < x.size(); ++i) at[i] += steps * h * v[i];
    sim.set_unknowns(at);
    difference += weight * sim.loss() / (12 * h);
  }
  EXPECT_NEAR(slope, difference, 1e-9 * std::abs(slope));
}

TEST(HostNetworks, GradientsByWeightsAreDifferencesOfTheLoss) {
  expect_differences(scene("f64"));
  expect_differences(scene("f64", in_formulas));
}

/// The formulas of initial states follow the weights.
TEST(HostNetworks, BeginAsTheWeightsSay) {
  Simulation sim = compile_text(scene("f64", in_formulas), {.name = "t"});
  const std::vector<double> before = sim.initial("u");
  sim.set_weights("corrector", std::vector<double>(36, 0.0));
  EXPECT_EQ(sim.initial("u"), std::vector<double>(16, 0.0));
  EXPECT_NE(before, sim.initial("u"));
}

TEST(HostNetworks, AreTheSameOnEveryBackEndAndForAnyNumberOfThreads) {
  for (const auto& [precision, initial, tolerance] :
       {std::tuple{"f64", "sin(2*pi*x)", 1e-12}, {"f32", "sin(2*pi*x)", 2e-6}, {"f64", in_formulas.c_str(), 1e-12}}) {
    Simulation sim = compile_text(scene(precision, initial), {.name = "t"});
    const double loss = sim.gradient();
    const std::vector<double> expected(sim.gradient_vector().begin(), sim.gradient_vector().end());
    for (const HostBackend backend : {HostBackend::cpp, HostBackend::interpreter}) {
      Simulation other = compile_text(scene(precision, initial), {.name = "t", .backend = backend});
      EXPECT_NEAR(other.gradient(), loss, tolerance * loss);
      double worst = 0, largest = 0;
      for (std::size_t i = 0; i < expected.size(); ++i) {
        worst = std::max(worst, std::abs(other.gradient_vector()[i] - expected[i]));
        largest = std::max(largest, std::abs(expected[i]));
      }
      EXPECT_LT(worst, tolerance * largest);
    }
    Simulation threads = compile_text(scene(precision, initial), {.name = "t", .threads = 3});
    EXPECT_EQ(threads.gradient(), loss);
    EXPECT_EQ(std::vector<double>(threads.gradient_vector().begin(), threads.gradient_vector().end()), expected);
  }
}

/// Weights of 0 correct nothing; others count from the next step on.
TEST(HostNetworks, StepWithTheWeightsThatAreSet) {
  Simulation sim = compile_text(scene("f64"), {.name = "t"});
  std::string without = scene("f64");
  without.erase(without.find("  after step: u += corrector(u)"), 31);
  without.erase(without.find("task t"));
  Simulation plain = compile_text(without, {.name = "r"});
  const std::vector<double> own = sim.weights("corrector");
  Simulation other = compile_text(scene("f64"), {.name = "t"});  // with the weights that it begins with
  other.step(3);
  sim.set_weights("corrector", own);
  sim.step(3);
  EXPECT_EQ(sim.state("u"), other.state("u"));
  sim.reset();
  sim.set_weights("corrector", std::vector<double>(own.size(), 0.0));
  for (Simulation* each : {&sim, &plain}) each->step(3);
  EXPECT_EQ(sim.state("u"), plain.state("u"));
  sim.set_weights("corrector", own);
  for (Simulation* each : {&sim, &plain}) each->step(1);
  EXPECT_NE(sim.state("u"), plain.state("u"));
  EXPECT_EQ(sim.networks(), std::vector<std::string>{"corrector"});
  EXPECT_THROW(sim.set_weights("corrector", std::vector<double>(3)), Error);
  EXPECT_THROW(sim.weights("corector"), Error);
}

TEST(HostNetworks, HessiansByWeightsAreDifferencesOfGradients) {
  Simulation sim = compile_text(scene("f64"), {.name = "t", .second_order = true});
  const std::vector<double> x = sim.unknown_values(), v = random_values(x.size(), 5);
  const std::vector<double> product = sim.hessian_vector(v);
  ASSERT_EQ(product.size(), x.size());
  const double h = 2e-4;
  std::vector<double> difference(x.size(), 0.0);
  for (const auto& [steps, weight] : {std::pair{1, 8.0}, {-1, -8.0}, {2, -1.0}, {-2, 1.0}}) {
    std::vector<double> at = x;
    for (std::size_t i = 0; i < x.size(); ++i) at[i] += steps * h * v[i];
    sim.set_unknowns(at);
    sim.gradient();
    for (std::size_t i = 0; i < x.size(); ++i) difference[i] += weight * sim.gradient_vector()[i] / (12 * h);
  }
  double worst = 0, largest = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    worst = std::max(worst, std::abs(product[i] - difference[i]));
    largest = std::max(largest, std::abs(product[i]));
  }
  EXPECT_LT(worst, 1e-8 * largest);
}

}  // namespace
}  // namespace dpde::testing
