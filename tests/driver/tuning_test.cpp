// SPDX-License-Identifier: Apache-2.0
// What a run finds out about the fastest way to sweep is kept in the cache, used by the next one, and changes no result.
#include <gtest/gtest.h>

#include <filesystem>

#include "driver/cache_folder.h"
#include "driver/session.h"
#include "driver/tuning.h"
#include "driver_support.h"

namespace dpde::driver {
namespace {

/// A mean, so that no steps are blocked; 4.9 MB a field.
const std::string plate = R"(
model heat { field u; param kappa; dt(u) = kappa*lap(u) - mean(u)*dx(u) }
scheme s { time = euler }
scene go : heat with s {
  grid x = 0 .. 1, cells 1024
  grid y = 0 .. 1, cells 600
  boundary u: x = 0.5, y = zero_gradient
  kappa = 1
  initial u = sin(9*x)*cos(7*y)
  time 0 .. 6e-6, step 1e-7
})";

struct Ran {
  std::string before, after;  // tuning
  std::vector<double> state;
};

Ran run(const std::filesystem::path& folder) {
  const SourceFile source("plate.dpde", plate);
  DiagnosticSink sink;
  CompileOptions options;
  options.backend = Backend::jit;
  if (!folder.empty()) options.cache = open_cache(folder);
  const auto session = Session::open(source, testing::compiled(source, options), {}, sink);
  EXPECT_TRUE(session) << testing::all_messages(source, sink);
  Ran ran{session->rollout().tuning(), {}, {}};
  EXPECT_EQ(session->rollout().run().steps_done, 60);
  ran.after = session->rollout().tuning();
  ran.state = session->final_state(0);
  return ran;
}

TEST(Tuning, IsKeptAndChangesNoResult) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "tuning_cache";
  std::filesystem::remove_all(folder);
  const Ran first = run(folder), second = run(folder), without = run({});
  EXPECT_EQ(first.before, "");
  EXPECT_TRUE(first.after.starts_with("go_step\n")) << first.after;
  EXPECT_EQ(second.before, first.after);
  EXPECT_EQ(second.after, first.after);
  EXPECT_EQ(without.before, "");
  EXPECT_EQ(second.state, first.state);
  EXPECT_EQ(without.state, first.state);
}

}  // namespace
}  // namespace dpde::driver
