// SPDX-License-Identifier: Apache-2.0
// Compiled tangents have the same columns as interpreted ones.
#include "stability/step/compiled_tangent.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <set>
#include <utility>

#include "stability/eigenvalues/eigenvalues.h"
#include "stability/equations.h"
#include "stability/frozen/fixed_part.h"
#include "stability/stability_support.h"
#include "stability/step/tangent_runs.h"
#include "stencil/analyse/effects.h"
#include "stencil/build.h"

namespace dpde::stability {
namespace {

void expect_columns_of_interpreter(const std::string& text) {
  const auto session = open_scene(text);
  std::string why;
  const std::optional<LinearStep> linear = linear_step(*session, why);
  ASSERT_TRUE(linear.has_value()) << why;
  const auto compiled = CompiledTangent::make(*linear);
  ASSERT_NE(compiled, nullptr);
  stencil::State inputs = memory_for(*linear, grid_of(session->axes()));
  stencil::Params params{{"dt", session->problem().step}, {"t", 0.25}};
  for (const auto& [name, value] : session->workspace().params()) params[std::string(name)] = value;
  for (std::size_t a = 0; a < session->axes().size(); ++a) {
    const model::Axis& axis = session->axes()[a];
    params["h" + axis.name] = axis.spacing();
    inputs.set_coordinate(static_cast<int>(a), axis.topology, axis.low, axis.spacing());
  }
  for (const std::string& input : linear->inputs()) {
    if (stencil::is_coordinate(input)) continue;
    const int state = session->engine().state_index(input);
    inputs.set(input, state < 0 ? session->workspace().dense(input) : session->initial(state));
  }
  const Eigen::MatrixXd matrix = compiled->matrix(inputs, params);
  const std::size_t cells = session->workspace().cell_count(), states = linear->states().size();
  ASSERT_EQ(matrix.rows(), static_cast<Eigen::Index>(cells * states));
  EXPECT_GT((matrix - Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols())).norm(), 1e-3);
  for (std::size_t column = 0; column < cells * states; ++column) {
    stencil::State memory = inputs;
    for (std::size_t s = 0; s < states; ++s) {
      std::vector<double> values(cells, 0.0);
      if (s == column / cells) values[column % cells] = 1;
      memory.set(linear->perturbation_of(s), values);
    }
    stencil::interpret(linear->module(), linear->program(), memory, params);
    for (std::size_t s = 0; s < states; ++s) {
      const std::vector<double> values = memory.get(linear->perturbation_of(s));
      for (std::size_t i = 0; i < cells; ++i) {
        const double found = matrix(static_cast<Eigen::Index>(s * cells + i), static_cast<Eigen::Index>(column));
        ASSERT_NEAR(found, values[i], 1e-13) << linear->states()[s] << " " << i << " column " << column;
      }
    }
  }
}

TEST(CompiledTangent, HasTheColumnsOfTheInterpreter) {
  const std::string schemes = "scheme e { time = euler }\nscheme r { time = rk4; advect = upwind(3) }\n";
  expect_columns_of_interpreter(
      "model m { field u, v; coefficient c\n  dt(u) = div(c*grad(u)) - u*v^2; dt(v) = (1 + x*y)*lap(v) "
      "- advect((u, 1), v) }\n" +
      schemes +
      "scene s : m with r {\n  grid x = 0 .. 1, cells 5\n  grid y = 0 .. 2, cells 7\n  c = 1 + 0.3*x\n"
      "  boundary u: x.low = 0, x.high = mixed(1, 0.5, 0), y = zero_gradient\n  boundary v: all = linear\n"
      "  initial u = 1 + 0.2*sin(x + y)\n  initial v = cos(x*y)\n  time 0 .. 1, step 1/500\n}\n");
  expect_columns_of_interpreter(
      "model m { field u; param k\n  dt(u) = k*lap(u) - u^3 }\n" + schemes +
      "scene s : m with e {\n  grid x = 0 .. 1, cells 3\n  grid y = 0 .. 1, cells 4, periodic\n"
      "  grid z = 0 .. 1, cells 2\n"
      "  k = 0.1\n  boundary u: x = 0, z = zero_gradient\n  initial u = x + z\n  time 0 .. 1, step 1/100\n}\n");
}

/// Stages of the states are computed once, before the steps; later statements read them, with halos and walls. A step
/// of the tangent then runs only the stages of perturbations.
TEST(CompiledTangent, MakesStagesOfStatesOnce) {
  const std::string text =
      "model m { vector u on faces; field h\n  dt(u) = -grad(h + 0.5*dot(u, u))\n  dt(h) = -div(interpolate(h)*u) }\n"
      "scheme r { time = rk4; dx = central(2); lap = central(2); advect = central(2) }\n"
      "scene s : m with r {\n  grid x = 0 .. 1, cells 5\n  grid y = 0 .. 2, cells 4, periodic\n"
      "  boundary u.x: x = 0\n  boundary u.y: x = zero_gradient\n  boundary h: x = zero_gradient\n"
      "  initial u = (x*(1 - x), 0.1*sin(pi*y))\n"
      "  initial h = 1 + 0.1*x + 0.2*cos(pi*y)\n  time 0 .. 1, step 1/200\n}\n";
  expect_columns_of_interpreter(text);
  const auto session = open_scene(text);
  std::string why;
  const std::optional<LinearStep> linear = linear_step(*session, why);
  ASSERT_TRUE(linear.has_value()) << why;
  std::set<std::string> perturbations;
  for (std::size_t s = 0; s < linear->states().size(); ++s) perturbations.insert(linear->perturbation_of(s));
  const ApartModule apart = with_fixed_part_apart(linear->module(), perturbations);
  ASSERT_FALSE(apart.fixed.empty());
  for (const stencil::Kernel* kernel : kernels_run(apart.module, *apart.module.find_program(apart.fixed))) {
    for (const stencil::Store& made : kernel->stores) EXPECT_FALSE(linear->is_perturbation(made.field)) << made.field;
  }
  for (const stencil::Kernel* kernel : kernels_run(apart.module, apart.module.programs.front())) {
    for (const stencil::Store& made : kernel->stores) EXPECT_TRUE(linear->is_perturbation(made.field)) << made.field;
  }
}

/// A field that is computed twice is not moved away from the statements that read it in between.
TEST(CompiledTangent, LeavesWhatIsMadeTwice) {
  const auto kernel = [](const std::string& name, const std::string& to, stencil::Expr value) {
    stencil::Kernel result{name, 1};
    result.stores.push_back({to, false, std::move(value), {}});
    return result;
  };
  const stencil::Expr s = stencil::access("s"), p = stencil::access("p"), a = stencil::access("a");
  stencil::Module module;
  module.kernels = {kernel("first", "a", s + 1.0), kernel("use", "b", a * p), kernel("second", "a", s + 2.0),
                    kernel("next", "q", stencil::access("b") + a * p)};
  const auto fixed_part_of = [&](const std::vector<std::string>& kernels) {
    stencil::Program step{"step", {Topology::periodic}, {}, {{"p", "q"}}, {}};
    for (const std::string& name : kernels) step.body.emplace_back(stencil::Run{name});
    module.programs = {step};
    return with_fixed_part_apart(module, {"p"}).fixed;
  };
  EXPECT_EQ(fixed_part_of({"first", "use", "second", "next"}), "");
  EXPECT_NE(fixed_part_of({"first", "use", "next"}), "");
}

/// With parts of a step, and with the means in them.
TEST(CompiledTangent, HasTheColumnsOfRepeats) {
  expect_columns_of_interpreter(
      "model m { field u, v\n  dt(u) = lap(u) - v*u + 2*(mean(v) - mean(u)); dt(v) = 0.3*lap(v) - advect((1, u), v) }\n"
      "scheme r { time = rk4; dx = central(2); advect = central(2) }\n"
      "scene s : m with r {\n  grid x = 0 .. 1, cells 5, periodic\n  grid y = 0 .. 2, cells 4\n"
      "  boundary u: y = 0\n  boundary v: y = zero_gradient\n  subcycle u in 3\n"
      "  initial u = 1 + 0.2*sin(2*pi*x)*y\n  initial v = cos(y)\n  time 0 .. 1, step 1/200\n}\n");
}

/// u and v rotate into one another with frequency 3 on four cells, in all but their means, which stay.
class Spaces : public ::testing::Test {
 protected:
  void SetUp() override {
    session_ = open_scene(
        "model m { field u, v; coefficient q; dt(u) = 3*mean(q*v); dt(v) = -3*mean(q*u) }\n"
        "scheme c { time = euler }\nscene s : m with c { grid x = 0 .. 1, cells 4, periodic; q = 1 + sin(2*pi*x); "
        "initial u = 1; initial v = 0; time 0 .. 1, step 0.1 }\n");
    std::string why;
    linear_ = linear_step(*session_, why);
    ASSERT_TRUE(linear_.has_value()) << why;
    auto tangent = CompiledTangent::of_coupled(*linear_);
    ASSERT_NE(tangent, nullptr);
    runs_.emplace(std::move(tangent), initial_inputs(*session_, *linear_));
  }
  KrylovSpace space(const Eigen::MatrixXd& start, int most) const {
    return runs_->on_krylov_space({{"dt", 0.1}, {"hx", 0.25}, {"t", 0}}, start, most);
  }
  static double most(const KrylovSpace& space) { return eigenvalues(space.matrix).cwiseAbs().maxCoeff(); }

  std::unique_ptr<driver::Session> session_;
  std::optional<LinearStep> linear_;
  std::optional<TangentRuns> runs_;
};

/// What turns is two vectors, one beside these is what stays.
TEST_F(Spaces, EndWhereTheyHoldAllThatStepsMake) {
  Eigen::MatrixXd start = Eigen::MatrixXd::Ones(4, 2);
  EXPECT_EQ(space(start, 8).matrix.rows(), 2);
  start(1, 0) = 3;
  const KrylovSpace all = space(start, 8);
  EXPECT_EQ(all.matrix.rows(), 3);
  EXPECT_NEAR(all.rest, 0, 1e-12);
  EXPECT_NEAR(most(all), std::hypot(1, 0.3), 1e-12);
}

TEST_F(Spaces, TellWhatLeavesThem) {
  Eigen::MatrixXd start = Eigen::MatrixXd::Ones(4, 2);
  start(1, 0) = 3;
  const KrylovSpace part = space(start, 2);
  ASSERT_EQ(part.matrix.rows(), 2);
  EXPECT_GT(part.rest, 1e-3);
  for (const std::complex<double> value : eigenvalues(part.matrix))
    EXPECT_GT(error_of_space(part.matrix, value, part.rest, 0), 0.1 * std::abs(std::abs(value) - std::hypot(1, 0.3)));
}

/// Taylor's polynomial of degree 8 leaves 0.3^10/(10*8!) of what turns by 0.3.
TEST_F(Spaces, OfTheFlowNeitherGrowNorDecay) {
  runs_->follow_flow();
  EXPECT_NEAR(most(space(Eigen::MatrixXd::Ones(4, 2), 8)), 1, 2e-11);
}

/// A step of another length, or values that were not finite, do not affect later runs.
TEST_F(Spaces, LeaveNothingToTheNext) {
  const Eigen::MatrixXd start = Eigen::MatrixXd::Ones(4, 2);
  const KrylovSpace first = space(start, 8);
  runs_->on_krylov_space({{"dt", 0.7}, {"hx", 0.25}, {"t", 0}}, 3 * start, 8);
  space(Eigen::MatrixXd::Constant(4, 2, std::numeric_limits<double>::infinity()), 8);
  EXPECT_EQ(space(start, 8).matrix, first.matrix);
  EXPECT_NEAR((first.basis.transpose() * first.basis - Eigen::MatrixXd::Identity(2, 2)).norm(), 0, 1e-14);
}

TEST_F(Spaces, OfWhatIsNotFiniteAreEmpty) {
  const Eigen::MatrixXd start = Eigen::MatrixXd::Constant(4, 2, std::numeric_limits<double>::infinity());
  EXPECT_EQ(space(start, 8).matrix.rows(), 0);
}

}  // namespace
}  // namespace dpde::stability
