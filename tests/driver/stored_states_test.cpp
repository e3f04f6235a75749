// SPDX-License-Identifier: Apache-2.0
// A gradient that stores all steps keeps only the parts of each state that the adjoint reads.
#include "driver/scene/inverse.h"
#include "driver_support.h"

namespace dpde::testing {
namespace {

constexpr int step_count = 12;

/// A wave. The adjoint of the leapfrog step reads p and not dt(p), that of the Verlet step both.
std::string wave(const std::string& scheme, const std::string& loss) {
  return R"(
model wave { field p; coefficient c2; dt(dt(p)) = c2*lap(p) }
scheme plain { lap = central(4); time = )" +
         scheme + R"( }
scene pool : wave with plain {
  grid x = 0 .. 1, cells 12, periodic
  grid y = 0 .. 1, cells 9
  c2 = 1 + 0.2*x*y
  boundary p = zero_gradient
  initial p = sin(2*pi*x) + y^2
  initial dt(p) = y
  time 0 .. 0.3, step 0.025
}
task find : pool {
  unknown c2
  unknown initial p
)" + loss +
         "\n}\n";
}

struct Found {
  Eigen::VectorXd gradient;
  GradientResult result;
};

Found gradient_with(const std::string& text, const driver::SessionOptions& options) {
  const SourceFile source("t.dpde", text);
  driver::CompileOptions compile;
  compile.backend = driver::Backend::jit;
  compile.adjoint = true;
  const auto scene = compiled(source, compile);
  DiagnosticSink sink;
  const auto session = driver::Session::open(source, scene, options, sink);
  const auto inverse = session ? driver::Inverse::open(*session, source, sink) : nullptr;
  if (!inverse) {
    ADD_FAILURE() << all_messages(source, sink);
    return {};
  }
  Found found{Eigen::VectorXd(inverse->size()), {}};
  for (int times = 0; times < 2; ++times) inverse->value_and_gradient(inverse->start(), found.gradient);
  found.result = inverse->last();
  return found;
}

/// Results are bit-identical whatever is stored, for the first gradient and later ones.
void expect_same_bits(const std::string& text) {
  const Found all = gradient_with(text, {});
  EXPECT_EQ(all.result.recomputed_steps, 0);
  EXPECT_GT(all.gradient.norm(), 0);
  for (const int slots : {1, 2, 5, step_count - 2, step_count - 1}) {
    const Found some = gradient_with(text, {.slots = slots});
    EXPECT_EQ(some.gradient, all.gradient) << slots << " slots";
    EXPECT_EQ(some.result.recomputed_steps == 0, slots == step_count - 1) << slots << " slots";
  }
}

TEST(StoredStates, WithoutThoseThatTheWayBackDoesNotRead) {
  const std::string text = wave("leapfrog", "minimise mean(p^2) at t = 0.3");
  expect_same_bits(text);
  const std::int64_t all = gradient_with(text, {}).result.checkpoint_bytes;
  const std::int64_t but_one = gradient_with(text, {.slots = step_count - 2}).result.checkpoint_bytes;
  // p: one buffer per step and the seeds; dt(p): three and the seeds. With one slot less, both are in all buffers.
  EXPECT_EQ(all * 2 * step_count, but_one * (step_count + 1 + 4));
}

TEST(StoredStates, AreAllThatALossOnTheWayReads) {
  for (const char* loss : {"minimise mean(dt(p)^2) over time", "minimise mean(p^2) at t = 0.1, 0.2, 0.3",
                           "minimise mean(dt(p)^2) at t = 0.3", "minimise mean((p*dt(p))^2) at t = 0.1, 0.3"}) {
    SCOPED_TRACE(loss);
    expect_same_bits(wave("verlet", loss));
  }
  expect_same_bits(wave("leapfrog", "minimise mean(p^2) at t = 0.1, 0.2, 0.3"));
}

}  // namespace
}  // namespace dpde::testing
