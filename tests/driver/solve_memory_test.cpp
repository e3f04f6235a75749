// SPDX-License-Identifier: Apache-2.0
// Gradients through solves are bit-identical for any number of solutions stored for the adjoints and any number of
// stored states; memory stays within the budget.
#include "driver/memory/storage.h"
#include "driver/scene/inverse.h"
#include "driver/scene/session.h"
#include "driver_support.h"

namespace dpde::driver {
namespace {

struct GradientOfSolves {
  double loss = 0;
  Eigen::VectorXd values;
  GradientResult result;
};

class SolveMemory {
 public:
  explicit SolveMemory(const std::string& text) : source_("test.dpde", text) {
    CompileOptions options;
    options.selection.name = "t";
    options.backend = Backend::jit;
    options.adjoint = true;
    compiled_ = testing::compiled(source_, options);
    if (compiled_ == nullptr) throw std::runtime_error("not compiled");
  }

  GradientOfSolves gradient(const SessionOptions& options, int times = 1) {
    DiagnosticSink sink;
    const auto session = Session::open(source_, compiled_, options, sink);
    if (!session) throw std::runtime_error(testing::all_messages(source_, sink));
    const auto opened = Inverse::open(*session, source_, sink);
    if (!opened) throw std::runtime_error(testing::all_messages(source_, sink));
    Inverse& inverse = *opened;
    GradientOfSolves found;
    found.values.resize(inverse.size());
    Eigen::VectorXd x = inverse.start();
    for (int k = 0; k < times; ++k) {
      if (k > 0) x *= 0.9;
      found.loss = inverse.value_and_gradient(x, found.values);
    }
    found.result = inverse.last();
    return found;
  }

  /// Expects `found` stored solutions if there is room.
  void expect_same(std::int64_t found) {
    for (const int times : {1, 2}) {
      const GradientOfSolves all = gradient({}, times);
      EXPECT_EQ(all.result.tapes_used, found);
      const SessionOptions states_alone{.checkpoint_bytes = all.result.checkpoint_bytes};
      const GradientOfSolves none = gradient(states_alone, times);
      EXPECT_EQ(none.result.tapes_used, 0);
      EXPECT_EQ(all.loss, none.loss);
      EXPECT_EQ(all.values, none.values);
      const SessionOptions half{.checkpoint_bytes = all.result.checkpoint_bytes + all.result.tape_bytes / 2};
      for (const SessionOptions& options : {half, SessionOptions{.slots = 1}, SessionOptions{.slots = 3}}) {
        const GradientOfSolves some = gradient(options, times);
        EXPECT_EQ(some.loss, none.loss);
        EXPECT_EQ(some.values, none.values);
        if (options.slots == 0) {
          EXPECT_LE(some.result.checkpoint_bytes + some.result.tape_bytes, options.checkpoint_bytes);
        }
      }
    }
  }

 private:
  SourceFile source_;
  std::shared_ptr<const Compiled> compiled_;
};

std::string box(const std::string& scheme) {
  return R"(
model flow { vector u on faces; field p; param nu
  dt(u) = -advect(u, u) - grad(p) + nu*lap(u)
  0 = div(u) gives p }
scheme c { advect = central(2); lap = central(2); )" +
         scheme + R"( }
scene s : flow with c {
  grid x = 0 .. 1, cells 9
  grid y = 0 .. 1, cells 6, periodic
  nu = 0.05
  initial u = (x*(1 - x)*sin(2*pi*y), x*(1 - x)*cos(2*pi*y))
  boundary u: x = 0
  time 0 .. 0.1, step 0.01
}
task t : s { unknown nu; unknown initial u; minimise mean(u.x^2) + mean(u.y^2) over time })";
}

/// The last stage is linear: its adjoint needs no solution.
TEST(SolveMemory, HoldsThePressuresOfAllStages) { SolveMemory(box("time = rk4")).expect_same(3 * 10); }

/// The first solve, which verifies the series, and later ones are bit-identical.
TEST(SolveMemory, HoldsThoseOfFloats) {
  SolveMemory(box("time = rk4; real = f32; solve = fourier")).expect_same(3 * 10);
}

TEST(SolveMemory, KnowsWhatSolvesBeginWith) {
  SolveMemory(box("time = rk2; solve = cg(1e-6)")).expect_same(1 * 10);
  SolveMemory(box("time = rk2; solve = multigrid(1e-3, 50); guess = last")).expect_same(1 * 10);
}

/// The same right-hand side in all steps, but a different operator in each: a lookup by the right-hand side alone would
/// be wrong.
TEST(SolveMemory, DropsSolutionsOfOtherOperators) {
  SolveMemory memory(R"(
model m { field u; param k
  solve lap(phi) - (1 + 9*t)*phi = -1 for phi
  dt(u) = k*phi*u + 0.01*lap(u) }
scheme c { lap = central(2); time = rk2 }
scene s : m with c {
  grid x = 0 .. 1, cells 8
  k = 2
  initial u = 1 + x
  boundary phi: x = 0
  boundary u: x = zero_gradient
  time 0 .. 0.2, step 0.02
}
task t : s { unknown k; unknown initial u; minimise mean(u^2) })");
  const GradientOfSolves all = memory.gradient({}),
                         none = memory.gradient({.checkpoint_bytes = all.result.checkpoint_bytes});
  EXPECT_GT(all.result.tape_bytes, 0);
  EXPECT_EQ(none.result.tapes_used, 0);
  EXPECT_EQ(all.values, none.values);
}

}  // namespace
}  // namespace dpde::driver
