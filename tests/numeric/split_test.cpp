// SPDX-License-Identifier: Apache-2.0
// Split steps: orders against closed forms, inputs of each substep, certified derivatives.
#include <fmt/format.h>

#include <cmath>

#include "../driver/driver_support.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

/// u = exp(-t)*(2 + cos(x)), with the source that makes it a solution.
std::string reacting_in_parts(const std::string& split, const std::string& time) {
  return fmt::format(R"(
model one {{ field u; param k; dt(u) = k*lap(u) - u^2 + exp(-t)*((k - 1)*cos(x) - 2) + exp(-2*t)*(2 + cos(x))^2 }}
scheme s {{ lap = central(8); time = {}; {} }}
scene reaction : one with s {{
  grid x = 0 .. 2*pi, cells 32, periodic
  k = 0.5
  initial u = 2 + cos(x)
  exact u = exp(-t)*(2 + cos(x))
  time 0 .. 1, step 1/64
}}
)",
                     time, split.empty() ? "" : "split = " + split);
}

double order_in_time(const std::string& text, const std::string& scene, const std::string& field, int parts) {
  const auto error = [&](int level) {
    return run_scene(text, scene, {{"step", "1/" + std::to_string(parts << level)}}).l2.at(field);
  };
  return std::log2(error(0) / error(1));
}

TEST(Split, ReactionAndDiffusionAreOfOrderOneAndTwo) {
  for (const char* time : {"rk2", "rk4", "ars222"}) {
    for (const char* parts : {"diffusion, sources", "sources, diffusion"}) {
      const std::string lie = reacting_in_parts(fmt::format("lie({})", parts), time);
      const std::string strang = reacting_in_parts(fmt::format("strang({})", parts), time);
      EXPECT_NEAR(order_in_time(lie, "reaction", "u", 64), 1, 0.1) << time << " " << parts;
      EXPECT_NEAR(order_in_time(strang, "reaction", "u", 64), 2, 0.1) << time << " " << parts;
    }
  }
}

/// A wave advected by a wind that depends on t, with decay and diffusion.
const std::string carried = R"(
model m {
  field u
  param k
  dt(u) = -advect(1 + cos(3*t), u) + k*lap(u) - (1 + sin(t))*u
}
scheme s { advect = semi_lagrangian(cubic); lap = central(8); time = rk4; split = SPLIT }
scene ring : m with s {
  grid x = 0 .. 2*pi, cells 128, periodic
  k = 0.02
  initial u = 2 + sin(x)
  exact u = exp(-t - 1 + cos(t))*(2 + exp(-k*t)*sin(x - t - sin(3*t)/3))
  time 0 .. 1, step 1/16
}
)";

TEST(Split, IsCertified) {
  for (const char* kind : {"lie", "strang"}) {
    for (const char* time : {"rk2", "ars222"}) {
      const std::string text =
          reacting_in_parts(fmt::format("{}(sources, diffusion)", kind), time) +
          "task t : reaction { unknown initial u; unknown k; minimise mean((u - 0.3*sin(x))^2) }\n";
      expect_certified(text, true);
    }
  }
}

std::string with(std::string text, const std::string& mark, const std::string& value) {
  const std::size_t at = text.find(mark);
  return text.replace(at, mark.size(), value);
}

TEST(Split, TransportDiffusionAndSourcesAreOfOrderTwo) {
  for (const char* parts : {"advect, sources, diffusion", "diffusion, advect, sources"}) {
    const std::string strang = with(carried, "SPLIT", fmt::format("strang({})", parts));
    EXPECT_NEAR(order_in_time(strang, "ring", "u", 8), 2, 0.15) << parts;
  }
}

/// Decay that varies in space: along x = t + c its rate adds up to t + sin(x) - sin(x - t).
const std::string fading = R"(
model m {
  field u
  dt(u) = -advect(1, u) - (1 + cos(x))*u
}
scheme s { advect = semi_lagrangian(cubic); time = rk4; split = SPLIT }
scene ring : m with s {
  grid x = 0 .. 2*pi, cells 256, periodic
  initial u = 2 + sin(x)
  exact u = exp(-t - sin(x) + sin(x - t))*(2 + sin(x - t))
  time 0 .. 1, step 1/16
}
)";

TEST(Split, TransportAndSourcesAreOfOrderOneAndTwo) {
  for (const char* parts : {"advect, sources", "sources, advect"}) {
    const std::string lie = with(fading, "SPLIT", fmt::format("lie({})", parts)),
                      strang = with(fading, "SPLIT", fmt::format("strang({})", parts));
    EXPECT_NEAR(order_in_time(lie, "ring", "u", 8), 1, 0.15) << parts;
    EXPECT_NEAR(order_in_time(strang, "ring", "u", 8), 2, 0.15) << parts;
  }
}

}  // namespace
}  // namespace dpde::testing
