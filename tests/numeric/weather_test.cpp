// SPDX-License-Identifier: Apache-2.0
// The weather examples: growth of waves against the linear equations of N. A. Phillips, Tellus 6 (1954) 273, and of the
// set-up of another code (pyqg); G. R. North, J. Atmos. Sci. 32 (1975) 2033, whose climate without ice is a polynomial.
#include <gtest/gtest.h>

#include <cmath>

#include "support/opened_scene.h"

namespace dpde::testing {
namespace {

const std::string folder = std::string(DPDE_SOURCE_DIR) + "/dsl-examples/weather/";

double observed_at_end(const std::string& file, const std::string& name, const Overrides& overrides) {
  const OpenedScene scene(read_file(folder + file), name, {overrides});
  scene.session->rollout().run();
  const auto values = scene.session->observe(scene.session->end_time(), scene.session->rollout().final_states());
  return values.front().second;
}

double growth_rate(const std::string& name, const std::string& from, const std::string& to) {
  const double before = observed_at_end("layers.dpde", name, {{"end", from}}),
               behind = observed_at_end("layers.dpde", name, {{"end", to}});
  return 0.5 * std::log(behind / before) / (std::stod(to) - std::stod(from));
}

TEST(TwoLayers, WavesGrowAsTheLinearEquationsSay) {
  EXPECT_NEAR(growth_rate("growth", "8", "10"), 2 * std::sqrt((8.0 - 4) / (8 + 4)), 1e-7);
  EXPECT_NEAR(growth_rate("ocean", "60000000", "80000000") / 1.680009e-7, 1, 1e-6);
}

TEST(Climate, WithoutIceIsALegendrePolynomial) {
  const auto error = [](const char* cells) {
    return run_scene(read_file(folder + "climate.dpde"), "bare", {{"cells", cells}}).l2.at("T");
  };
  EXPECT_NEAR(std::log2(error("32") / error("64")), 2, 0.05);
  EXPECT_LT(error("64"), 0.01);
}

/// Ice makes the climate more sensitive than the absorbed sunlight alone, 0.7/(4 B).
TEST(Climate, SensitivityWithIceIsThatOfRuns) {
  const std::string text = read_file(folder + "climate.dpde");
  const double by_adjoint = task_gradient(text, "sensitivity").gradient.at("S").front();
  const double by_runs = (observed_at_end("climate.dpde", "today", {{"S", "1360.1"}}) -
                          observed_at_end("climate.dpde", "today", {{"S", "1359.9"}})) /
                         0.2;
  EXPECT_NEAR(by_adjoint, by_runs, 1e-4 * by_runs);
  EXPECT_GT(by_adjoint, 1.5 * 0.7 / (4 * 2.09));
}

}  // namespace
}  // namespace dpde::testing
