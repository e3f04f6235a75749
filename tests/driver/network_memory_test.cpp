// SPDX-License-Identifier: Apache-2.0
// Gradients through networks are bit-identical for any amount of stored intermediate values, any number of stored
// states and threads; memory stays within the budget.
#include "driver/memory/storage.h"
#include "driver/scene/inverse.h"
#include "driver/scene/session.h"
#include "driver_support.h"

namespace dpde::driver {
namespace {

/// Two calls per step and one in the loss; a factor of the network's output, so that the adjoint needs the output
/// again.
const std::string text = R"(
network law(u) { initial he, seed 7; padding replicate; conv 5, 3; leaky_relu(0.2); residual { conv 5, 3; silu }; conv out, 3, gain = 0.3 }
network push(u, nu) { initial he, seed 3; dense 4; gelu; dense out }
model m { field u; param nu; dt(u) = -u*dx(u) + nu*law(u)*dx(u) }
scheme s { time = rk2 }
scene r : m with s {
  grid x = 0 .. 1, cells 9, periodic
  grid y = 0 .. 1, cells 6
  boundary u = zero_gradient
  nu = 0.05
  initial u = sin(2*pi*x) + y
  time 0 .. 0.24, step 0.02
  after step: u += 0.1*push(u, nu)
}
task t : r { learn law; learn push; unknown nu; unknown initial u; minimise mean(law(u)*u) over time })";

/// 12 steps with two stages and a push, and 13 losses. Adjoints need the value of law again if it is multiplied by
/// something else.
constexpr std::int64_t every_run = 12 * (2 * 2 + 1) + 13 * 2;

struct Gradient {
  double loss = 0;
  Eigen::VectorXd values;
  GradientResult result;
};

class NetworkMemory : public ::testing::Test {
 protected:
  void SetUp() override {
    CompileOptions options;
    options.selection.name = "t";
    options.backend = Backend::jit;
    options.adjoint = true;
    compiled_ = testing::compiled(source_, options);
    ASSERT_NE(compiled_, nullptr);
  }
  Gradient gradient(const SessionOptions& options, int times = 1) {
    DiagnosticSink sink;
    const auto session = Session::open(source_, compiled_, options, sink);
    EXPECT_NE(session, nullptr) << testing::all_messages(source_, sink);
    if (!session) return {};
    const auto opened = Inverse::open(*session, source_, sink);
    if (!opened) return {};
    Inverse& inverse = *opened;
    Gradient found;
    found.values.resize(inverse.size());
    Eigen::VectorXd x = inverse.start();
    for (int k = 0; k < times; ++k) {
      if (k > 0) x *= 0.9;
      found.loss = inverse.value_and_gradient(x, found.values);
    }
    found.result = inverse.last();
    return found;
  }
  SourceFile source_{"test.dpde", text};
  std::shared_ptr<const Compiled> compiled_;
};

TEST_F(NetworkMemory, HoldsAllRunsWhereThereIsRoom) {
  const Gradient all = gradient({});
  EXPECT_EQ(all.result.tapes_used, every_run);
  EXPECT_GT(all.result.tape_bytes, 0);
  EXPECT_EQ(all.result.recomputed_steps, 0);
}

TEST_F(NetworkMemory, DoesNotChangeGradients) {
  const Gradient all = gradient({}), none = gradient({.checkpoint_bytes = all.result.checkpoint_bytes});
  EXPECT_EQ(none.result.tapes_used, 0);
  const auto expect_same = [&](const SessionOptions& options, const std::string& what) {
    const Gradient found = gradient(options);
    EXPECT_EQ(found.loss, none.loss) << what;
    EXPECT_EQ(found.values, none.values) << what;
    if (options.slots == 0) {
      EXPECT_LE(found.result.checkpoint_bytes + found.result.tape_bytes, options.checkpoint_bytes) << what;
    }
    return found.result;
  };
  expect_same({}, "all");
  std::int64_t last = -1;
  for (const std::int64_t part : {0, 1, 2, 3, 5}) {
    const GradientResult result =
        expect_same({.checkpoint_bytes = all.result.checkpoint_bytes + part * all.result.tape_bytes / 4},
                    "part " + std::to_string(part));
    EXPECT_TRUE(result.tapes_used > last || result.tapes_used == all.result.tapes_used) << part;
    last = result.tapes_used;
  }
  for (const int slots : {1, 2, 3, 7, 12}) {
    for (const int threads : {1, 2, 3}) {
      const GradientResult result = expect_same({.threads = threads, .slots = slots},
                                                std::to_string(slots) + " slots, threads " + std::to_string(threads));
      EXPECT_GT(result.tapes_used, 0) << slots;
    }
  }
}

/// The prediction of `dpde check`.
TEST_F(NetworkMemory, IsPredicted) {
  const Gradient all = gradient({});
  for (const std::int64_t part : {-1, 0, 1, 2, 3, 4, 8}) {
    const std::int64_t budget = part < 0 ? std::numeric_limits<std::int64_t>::max()
                                         : all.result.checkpoint_bytes + part * all.result.tape_bytes / 4;
    for (const int threads : {1, 2}) {
      const std::optional<GradientPlan> plan =
          plan_of_gradient(*compiled_, {.threads = threads, .checkpoint_bytes = budget});
      const Gradient found = gradient({.threads = threads, .checkpoint_bytes = budget});
      ASSERT_TRUE(plan);
      EXPECT_EQ(plan->tape_bytes, found.result.tape_bytes) << part;
      EXPECT_EQ(plan->checkpoint_bytes, found.result.checkpoint_bytes) << part;
      EXPECT_EQ(plan->tape_bytes > 0, part != 0) << part;
    }
  }
}

TEST_F(NetworkMemory, KnowsNothingOfOtherWeights) {
  const Gradient kept = gradient({}, 3), again = gradient({.checkpoint_bytes = kept.result.checkpoint_bytes}, 3);
  EXPECT_EQ(kept.values, again.values);
  EXPECT_EQ(kept.result.tapes_used, every_run);
  EXPECT_NE(kept.values, gradient({}).values);
}

}  // namespace
}  // namespace dpde::driver
