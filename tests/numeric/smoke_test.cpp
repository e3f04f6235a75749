// SPDX-License-Identifier: Apache-2.0
// The two smoke scenes of the book "Physics-based Deep Learning" (overview-ns-forw.ipynb and diffphys-code-ns.ipynb):
// their steps with an exact projection, in double precision, from independent code.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "support/scene_run.h"

namespace dpde {
namespace {

using testing::run_scene;
using testing::task_gradient;
using testing::task_loss;

std::string smoke() { return testing::read_file(std::string(DPDE_SOURCE_DIR) + "/dsl-examples/smoke/smoke.dpde"); }

TEST(Smoke, RisesAsInTheBook) {
  const double fastest[] = {.46300111, .89664473, 1.40988794, 2.04112471, 2.92795787};  // of frames 0 to 4
  for (int frame = 0; frame < 5; ++frame) {
    const auto state = run_scene(smoke(), "plume", {{"end", std::to_string(1.5 * (frame + 2))}}).state;
    const std::vector<double>&x = state.at("u.x"), &y = state.at("u.y");
    const double largest = std::max(*std::ranges::max_element(x), *std::ranges::max_element(y));
    EXPECT_NEAR(largest, fastest[frame], 2e-8) << frame;
  }
  const std::vector<double> marker = run_scene(smoke(), "plume").state.at("marker");
  EXPECT_NEAR(std::accumulate(marker.begin(), marker.end(), 0.0) / marker.size(), 0.0699310, 1e-7);
}

TEST(Smoke, IsTheSameOnAllBackEnds) {
  const testing::Overrides coarse{{"cells.x", "8"}, {"cells.y", "10"}};
  const auto expected = run_scene(smoke(), "plume", coarse, driver::Backend::interpreter).state;
  for (const auto backend : {driver::Backend::jit, driver::Backend::cpp}) {
    for (const auto& [name, values] : run_scene(smoke(), "plume", coarse, backend).state) {
      for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(values[i], expected.at(name)[i], 1e-12) << name;
    }
  }
}

TEST(Smoke, FirstGradientIsThatOfTheBook) {
  const auto result = task_gradient(smoke(), "from_left");
  EXPECT_NEAR(result.loss, 120.574, 1e-3);
  const std::vector<double>&x = result.gradient.at("u.x"), &y = result.gradient.at("u.y");
  const auto square = [](const std::vector<double>& v) {
    return std::inner_product(v.begin(), v.end(), v.begin(), 0.0);
  };
  EXPECT_NEAR(std::sqrt(square(x) / (31 * 40)), 0.847, 1e-3);
  EXPECT_NEAR(std::sqrt(square(x) + square(y)), 105.06, 1e-2);
  EXPECT_NEAR(*std::ranges::min_element(x), -17.37, 1e-2);
  EXPECT_NEAR(*std::ranges::max_element(x), 14.02, 1e-2);
  const double losses = result.loss + task_loss(smoke(), "from_upper") + task_loss(smoke(), "from_middle");
  EXPECT_NEAR(losses, 298.28635, 1e-5);
}

/// Central differences along a smooth flow, with such short steps that the loss crosses few kinks.
TEST(Smoke, GradientAgreesWithCentralDifferences) {
  const auto flow = [](double x, double y) {
    return std::pair{std::sin(0.3 * x) * std::cos(0.2 * y), std::cos(0.25 * x + 0.1 * y)};
  };
  const auto loss = [](const char* task, const std::string& factor) {
    std::string text = smoke();
    const std::string from = "unknown initial u from 0", to = "unknown initial u from (" + factor +
                                                              "*sin(0.3*x)*cos(0.2*y), " + factor +
                                                              "*cos(0.25*x + 0.1*y))";
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
      text.replace(at, from.size(), to);
    return task_loss(text, task);
  };
  for (const char* task : {"from_left", "from_upper", "from_middle"}) {
    const auto gradient = task_gradient(smoke(), task).gradient;
    double slope = 0;
    for (int j = 0; j < 40; ++j) {
      for (int i = 0; i < 32; ++i) {
        slope += gradient.at("u.x")[j * 32 + i] * flow(i + 1, j + 0.5).first;
        slope += gradient.at("u.y")[j * 32 + i] * flow(i + 0.5, j + 1).second;
      }
    }
    const double difference = (loss(task, "1e-6") - loss(task, "(-1e-6)")) / 2e-6;
    EXPECT_NEAR(difference / slope, 1, 1e-6) << task;
  }
}

}  // namespace
}  // namespace dpde
