// SPDX-License-Identifier: Apache-2.0
// Single precision: the same program as in double precision up to rounding, in half the memory, with accurate sums;
// bit-identical for every number of threads and checkpoints.
#include <cmath>
#include <numbers>

#include "analysis/certificate/certificate.h"
#include "driver/driver_support.h"
#include "driver/memory/cost.h"
#include "driver/memory/storage.h"
#include "driver/report/blow_up.h"
#include "driver/scene/inverse.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

using driver::Backend;

/// An unknown initial state, an unknown field in div(k grad u), an unknown parameter, and walls.
constexpr const char* inverse_text = R"(model heat {
  field u
  coefficient k
  param a
  dt(u) = div(k*grad(u)) - a*u*dx(u)
}
scheme s { time = rk2 }
scene plate : heat with s {
  grid x = 0 .. 1, cells CELLS
  grid y = 0 .. 1, cells CELLS, periodic
  boundary u: x.low = 0.3, x.high = zero_gradient
  k = 0.01 + 0.005*x
  a = 0.2
  initial u = exp(-20*((x - 0.4)^2 + (y - 0.5)^2))
  observe mass = integral(u)
  time 0 .. STEPS*1e-3, step 1e-3
}
task find : plate {
  data u_ref = u from scene plate
  unknown initial u from 0.1*x
  unknown k from 0.012
  unknown a from 0.1
  minimise mean((u - u_ref)^2)
}
)";

std::string sized(std::string text, int cells, int steps) {
  const auto put = [&](const std::string& word, int value) {
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word))
      text.replace(at, word.size(), std::to_string(value));
  };
  put("CELLS", cells);
  put("STEPS", steps);
  return text;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double size = 0, difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    size = std::max(size, std::abs(a[i]));
    difference = std::max(difference, std::abs(a[i] - b[i]));
  }
  EXPECT_GT(size, 0);
  return difference / size;
}

TEST(SinglePrecision, StatesAreThoseOfDoublesButForRounding) {
  const std::string text = sized(inverse_text, 40, 50);
  const SceneResult exact = run_scene(text, "plate");
  for (const Backend backend : {Backend::jit, Backend::cpp, Backend::interpreter}) {
    const SceneResult single = run_scene(text, "plate", {{"real", "f32"}}, backend);
    const double error = largest_difference(exact.state.at("u"), single.state.at("u"));
    EXPECT_LT(error, 1e-5);
    EXPECT_GT(error, 1e-9);  // otherwise these were doubles
  }
}

/// The rows found by a solve are not lost in the rounding of differences: k*psi is 1e-5 of lap(psi).
TEST(SinglePrecision, SmallCoefficientsOfSolvesStay) {
  for (const char* along : {"cells 64, periodic",
                            "cells 64, stretched 0.5 + 0.5*tanh(2*y - 1)/tanh(1)\n"
                            "  boundary u: y = zero_gradient\n  boundary psi: y = zero_gradient"}) {
    const std::string text = std::string(R"(model m {
  field u
  coefficient k
  solve lap(psi) - k*psi = -u for psi
  dt(u) = psi
}
scheme s { dx = central(2); lap = central(2); time = euler }
scene room : m with s {
  grid x = 0 .. 1, cells 64, periodic
  grid y = 0 .. 1, )") + along +
                             R"(
  k = 0.1 + 0.08*cos(2*pi*x)
  initial u = 1
  time 0 .. 1, step 1
}
)";
    const double difference = largest_difference(run_scene(text, "room").state.at("u"),
                                                 run_scene(text, "room", {{"real", "f32"}}).state.at("u"));
    EXPECT_LT(difference, 0.05) << along;  // 23 when k was taken as uniform
  }
}

TEST(SinglePrecision, GradientsAreThoseOfDoublesTo1e4) {
  for (const int steps : {1, 100}) {
    const std::string text = sized(inverse_text, 24, steps);
    const TaskResult exact = task_gradient(text, "find"), single = task_gradient(text, "find", {{"real", "f32"}});
    EXPECT_NEAR(single.loss, exact.loss, 1e-5 * exact.loss);
    ASSERT_EQ(exact.gradient.size(), 3u);
    for (const auto& [unknown, values] : exact.gradient)
      EXPECT_LT(largest_difference(values, single.gradient.at(unknown)), 1e-4) << unknown;
  }
}

/// Through solves with cycles in f32: by right-hand sides, coefficients and walls.
TEST(SinglePrecision, GradientsThroughSolvesAreThoseOfDoubles) {
  for (const auto& [method, wind] : {std::pair{"multigrid", "0"}, {"cg", "0"}, {"bicgstab", "0.5"}}) {
    const std::string text = std::string("model m {\n  field u\n  coefficient k\n  param c\n") +
                             "  solve div(k*grad(psi)) - psi - c*dx(psi) = -u for psi\n  dt(u) = psi - 0.1*u\n}\n" +
                             "scheme s { time = rk2; solve = " + method + "(1e-10) }\n" + R"(scene plate : m with s {
  grid x = 0 .. 1, cells 24
  grid y = 0 .. 1, cells 20, periodic
  boundary psi: x.low = 0.2, x.high = zero_gradient
  boundary u: x = zero_gradient
  k = 0.5 + 0.3*x
  c = )" + wind + R"(
  initial u = exp(-20*((x - 0.4)^2 + (y - 0.5)^2))
  time 0 .. 0.3, step 0.1
}
task find : plate {
  data u_ref = u from scene plate
  unknown initial u from 0.1*x
  unknown k from 0.4
  minimise mean((u - u_ref)^2)
}
)";
    const TaskResult exact = task_gradient(text, "find"), single = task_gradient(text, "find", {{"real", "f32"}});
    EXPECT_NEAR(single.loss, exact.loss, 1e-5 * exact.loss) << method;
    ASSERT_EQ(exact.gradient.size(), 2u);
    for (const auto& [unknown, values] : exact.gradient)
      EXPECT_LT(largest_difference(values, single.gradient.at(unknown)), 1e-4) << method << " " << unknown;
  }
}

TEST(SinglePrecision, GradientsOfTheExamples) {
  const std::pair<const char*, const char*> examples[] = {{"burgers_1d/burgers.dpde", "recover"},
                                                          {"heat/heat.dpde", "conductivity"},
                                                          {"advection/advection.dpde", "speed"},
                                                          {"wave/wave.dpde", "recover"},
                                                          {"advection_diffusion/leak.dpde", "find"}};
  for (const auto& [file, task] : examples) {
    const std::string path = std::string(DPDE_SOURCE_DIR) + "/dsl-examples/" + file;
    SCOPED_TRACE(path);
    const std::string text = read_file(path);
    const TaskResult exact = task_gradient(text, task, {}, path),
                     single = task_gradient(text, task, {{"real", "f32"}}, path);
    ASSERT_FALSE(exact.gradient.empty());
    for (const auto& [unknown, values] : exact.gradient)
      EXPECT_LT(largest_difference(values, single.gradient.at(unknown)), 1e-4) << unknown;
  }
}

struct Gradient {
  double loss;
  Eigen::VectorXd gradient;
  std::int64_t checkpoint_bytes;
};

Gradient gradient_with(const std::string& text, Precision real, int threads, int slots) {
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.selection.name = "find";
  options.backend = Backend::jit;
  options.adjoint = true;
  options.real = real;
  DiagnosticSink sink;
  driver::SessionOptions session_options;
  session_options.threads = threads;
  session_options.slots = slots;
  const auto session = driver::Session::open(source, compiled(source, options), session_options, sink);
  const auto inverse = session ? driver::Inverse::open(*session, source, sink) : nullptr;
  EXPECT_TRUE(inverse) << all_messages(source, sink);
  if (!inverse) return {};
  Gradient result{0, Eigen::VectorXd(inverse->size()), 0};
  result.loss = inverse->value_and_gradient(inverse->start(), result.gradient);
  result.checkpoint_bytes = inverse->last().checkpoint_bytes;
  return result;
}

TEST(SinglePrecision, ThreadsAndCheckpointsChangeNoBit) {
  const std::string text = sized(inverse_text, 220, 6);
  for (const Precision real : {Precision::f32, Precision::f64}) {
    const Gradient one = gradient_with(text, real, 1, 0);
    for (const auto& [threads, slots] : {std::pair{2, 0}, {3, 0}, {2, 2}, {1, 3}}) {
      const Gradient other = gradient_with(text, real, threads, slots);
      EXPECT_EQ(other.loss, one.loss) << threads << " threads, " << slots << " slots";
      EXPECT_TRUE(other.gradient == one.gradient) << threads << " threads, " << slots << " slots";
    }
  }
}

TEST(SinglePrecision, HalvesMemory) {
  const std::string text = sized(inverse_text, 220, 6);
  const double whole = static_cast<double>(gradient_with(text, Precision::f64, 1, 0).checkpoint_bytes);
  EXPECT_NEAR(static_cast<double>(gradient_with(text, Precision::f32, 1, 0).checkpoint_bytes) / whole, 0.5, 0.05);
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.selection.name = "find";
  options.adjoint = true;
  const driver::Memory doubles = driver::memory_of(*compiled(source, options));
  const auto plan_of_doubles = driver::plan_of_gradient(*compiled(source, options), {});
  const double bytes = driver::cost_of(compiled(source, options)->loop, "plate_step").bytes;
  options.real = Precision::f32;
  const driver::Memory floats = driver::memory_of(*compiled(source, options));
  EXPECT_NEAR(floats.run / doubles.run, 0.5, 0.05);
  const auto plan_of_floats = driver::plan_of_gradient(*compiled(source, options), {});
  ASSERT_TRUE(plan_of_doubles && plan_of_floats);
  EXPECT_EQ(static_cast<double>(plan_of_doubles->checkpoint_bytes), whole);
  EXPECT_NEAR(static_cast<double>(plan_of_floats->checkpoint_bytes) / whole, 0.5, 0.05);
  EXPECT_EQ(driver::cost_of(compiled(source, options)->loop, "plate_step").bytes, bytes / 2);
}

/// A million floats of 0.1 sum up in doubles to within 1.5e-7 of the exact sum; in floats to within 1e-2.
TEST(SinglePrecision, SumsAreAddedUpInDoubles) {
  const std::string text =
      "model m { field u; dt(u) = 0 }\nscene s : m { grid x = 0 .. 1, cells 1000, periodic\ngrid y = 0 .. 1, cells "
      "1000, periodic\n"
      "initial u = 0.1\nobserve total = sum(u)\ntime 0 .. 1, step 1 }\n";
  const SourceFile source("test.dpde", text);
  for (const Backend backend : {Backend::jit, Backend::cpp}) {
    driver::CompileOptions options;
    options.backend = backend;
    options.real = Precision::f32;
    DiagnosticSink sink;
    const auto session = driver::Session::open(source, compiled(source, options), {}, sink);
    ASSERT_TRUE(session) << all_messages(source, sink);
    session->rollout().run();
    EXPECT_NEAR(session->observe(1, session->rollout().final_states()).at(0).second, 1e6 * 0.1f, 1e-9 * 1e5);
  }
}

/// d loss / d k is a sum over all steps, each about 1e-5 of it: a sum in floats would lose 3e-3.
TEST(SinglePrecision, GradientsOfCoefficientsAreAddedUpInDoubles) {
  const std::string text =
      "model m { field u; coefficient k; dt(u) = k }\nscheme e { time = euler }\nscene s : m with e { grid x = 0 .. 1, "
      "cells 4, periodic\n"
      "k = 1\ninitial u = 0\ntime 0 .. 100000, step 1 }\ntask t : s { unknown k from 1\nminimise sum(0.3*u) }\n";
  const TaskResult single = task_gradient(text, "t", {{"real", "f32"}});
  for (const double bar : single.gradient.at("k")) EXPECT_NEAR(bar, 1e5 * 0.3f, 1e-7 * 3e4);
}

TEST(SinglePrecision, BlowsUpWhereFloatsEnd) {
  const std::string text =
      "model m { field u; dt(u) = 9*u }\nscheme e { time = euler }\nscene s : m with e { grid x = 0 .. 1, cells 4, "
      "periodic\n"
      "initial u = 1\ntime 0 .. 100, step 1 }\n";  // u = 10^n: floats end at 3.4e38
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.backend = Backend::jit;
  options.real = Precision::f32;
  DiagnosticSink sink;
  const auto session = driver::Session::open(source, compiled(source, options), {}, sink);
  ASSERT_TRUE(session) << all_messages(source, sink);
  const RunResult result = session->rollout().run();
  ASSERT_TRUE(result.blow_up);
  EXPECT_EQ(result.blow_up->step, 39);
  driver::report_blow_up(*session, *result.blow_up, sink);
  EXPECT_NE(all_messages(source, sink).find("u is no longer finite after step 39 of 100"), std::string::npos)
      << all_messages(source, sink);
}

TEST(SinglePrecision, IsCertifiedBesideTheDoubles) {
  const SourceFile source("test.dpde", sized(inverse_text, 12, 20));
  driver::CompileOptions options;
  options.selection.name = "find";
  options.backend = Backend::jit;
  options.certify = options.tangent = options.adjoint = true;
  options.real = Precision::f64;
  DiagnosticSink sink;
  std::optional<analysis::Certificate> certificate = analysis::certify(source, compiled(source, options), {}, sink);
  ASSERT_TRUE(certificate) << all_messages(source, sink);
  EXPECT_LT(certificate->worst(), 1e-11);
  options.real = Precision::f32;
  ASSERT_TRUE(analysis::certify_single_precision(source, compiled(source, options), {}, *certificate, sink))
      << all_messages(source, sink);
  EXPECT_GE(certificate->single->cases.size(), 9u);
  EXPECT_GT(certificate->single->worst(), 1e-9);  // otherwise these were doubles
  EXPECT_LT(certificate->single->worst(), 1e-5);
  EXPECT_TRUE(certificate->passed());
  certificate->single->cases.push_back({"1", "a wrong one", 1e-3});
  EXPECT_FALSE(certificate->passed());
}

}  // namespace
}  // namespace dpde::testing
