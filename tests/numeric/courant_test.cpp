// SPDX-License-Identifier: Apache-2.0
// Steps limited by a Courant number: number of substeps, equality with hand-written steps, gradients.
#include <gtest/gtest.h>

#include <cmath>
#include <span>

#include "../driver/driver_support.h"
#include "dpde/runtime/error.h"
#include "driver/scene/session.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

std::string ring(const std::string& time, const std::string& rest = "") {
  return "model m { field u; param a; dt(u) = -advect(a, u) }\nscheme c { advect = upwind(1); time = euler }\n"
         "scene s : m with c {\n  grid x = 0 .. 1, cells 40, periodic\n  a = 1\n  initial u = sin(2*pi*x)\n  time " +
         time + "\n" + rest + "}\n";
}

std::int64_t parts_of(const std::string& text) {
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.backend = driver::Backend::jit;
  DiagnosticSink sink;
  const auto session = driver::Session::open(source, compiled(source, options), {}, sink);
  return session ? session->rollout().run().parts : -1;
}

/// Speed 1, h = 1/40: a step of 1/8 is 5 cells, so 10 substeps for 0.5 and 13 for 0.4.
TEST(Courant, CountsThePartsOfAStep) {
  EXPECT_EQ(parts_of(ring("0 .. 1, step 1/8, courant 0.5")), 80);
  EXPECT_EQ(parts_of(ring("0 .. 1, step 1/8, courant 0.4")), 104);
  // Speeds count per substep.
  EXPECT_EQ(parts_of(ring("0 .. 1, step 1/8, courant 0.5", "  subcycle u in 5\n")), 16);
  EXPECT_EQ(parts_of(ring("0 .. 1, step 1/8, courant 100")), 8);
  EXPECT_EQ(parts_of(ring("0 .. 1, step 1/8, courant 0.5, speed 2*a")), 160);
  EXPECT_EQ(parts_of(ring("0 .. 1, step 1/8")), 8);
}

TEST(Courant, PartsAreStepsByHand) {
  const std::vector<double> parts = run_scene(ring("0 .. 1, step 1/8, courant 0.5"), "s").state.at("u");
  const std::vector<double> steps = run_scene(ring("0 .. 1, step 1/80"), "s").state.at("u");
  for (std::size_t i = 0; i < parts.size(); ++i) EXPECT_NEAR(parts[i], steps[i], 1e-13);
}

/// u_t = u^2 with speed 10 u: u = 1/(2 - t) gets faster and faster, and substeps shorter.
TEST(Courant, FollowsTheState) {
  const auto text = [](const char* time) {
    return std::string(
               "model m { field u; dt(u) = u^2 }\nscheme c { time = rk4 }\nscene s : m with c {\n  grid x = 0 .. 1, "
               "cells 2, periodic\n"
               "  initial u = 1/2\n  time ") +
           time + "\n}\n";
  };
  std::int64_t expected = 0;
  for (int n = 0; n < 8; ++n) expected += static_cast<std::int64_t>(std::ceil(1. / 8 * 10 / (2 - n / 8.) * 2 / 0.5));
  EXPECT_EQ(parts_of(text("0 .. 1, step 1/8, courant 0.5, speed 10*u")), expected);
  EXPECT_NEAR(run_scene(text("0 .. 1, step 1/8, courant 0.1, speed 10*u"), "s").state.at("u")[0], 1, 1e-7);
}

TEST(Courant, EventsStayOnWholeSteps) {
  const auto end = [](const std::string& event) {
    std::string text = ring("0 .. 1, step 1/8, courant 0.5", "  " + event + "\n");
    text.replace(text.find("sin(2*pi*x)"), 11, "0");
    return run_scene(text, "s").state.at("u")[3];
  };
  EXPECT_NEAR(end("every 1/4: u += 1"), 4, 1e-12);
  EXPECT_NEAR(end("every 1/8: u += 1"), 8, 1e-12);
  EXPECT_NEAR(end("at t = 1/8, 1: u += 1"), 2, 1e-12);
  EXPECT_NEAR(end("after step: u += 1"), 8, 1e-12);
}

TEST(Courant, DerivativesAreCertified) {
  const std::string text =
      "model m {\n  field u, v\n  param nu\n  control F\n  dt(u) = -advect((u, v), u) + nu*lap(u) + F\n  dt(v) = "
      "-advect((u, v), v) + nu*lap(v)\n}\n"
      "scheme c { time = ssp_rk3 }\nscene s : m with c {\n  grid x = 0 .. 1, cells 7\n  grid y = 0 .. 1, cells 6, "
      "periodic\n"
      "  boundary u: x.low = sin(t), x.high = zero_gradient\n  boundary v = zero_gradient\n  nu = 0.02\n  F = sin(t) "
      "every 1/4\n"
      "  initial u = 1 + sin(3*x + 2*pi*y)\n  initial v = cos(x)\n  time 0 .. 1, step 1/8, courant 0.3\n  every 1/4: v "
      "+= 0.1*u*v\n}\n"
      "task t : s {\n  unknown initial u\n  unknown initial v\n  unknown nu\n  unknown F\n  minimise mean(u^2 + v^3)\n "
      " minimise mean(u*v) + F^2, mean over time\n}\n";
  expect_certified(text, true);
}

/// The speed is a control and an unknown: d mean(u(1)) of u_t = -F*a*u_x is 0; for u^2 tangent and adjoint must agree.
TEST(Courant, PartsFollowUnknownsAndControls) {
  const std::string text = ring("0 .. 1, step 1/8, courant 0.5");
  std::string varied = text;
  varied.replace(varied.find("field u"), 7, "field u; control F");
  varied.replace(varied.find("advect(a, u)"), 12, "advect(a*F, u)");
  varied.replace(varied.find("  time 0"), 8, "  F = if(t < 0.5, 1, 3) every 1/2\n  time 0");
  EXPECT_EQ(parts_of(varied), 4 * 10 + 4 * 30);
  varied += "task t : s {\n  unknown initial u\n  unknown a from 2\n  unknown F\n  minimise mean(u^4)\n}\n";
  const auto certificate = certificate_of(varied, false);
  ASSERT_TRUE(certificate);
  EXPECT_LT(certificate->worst(), 1e-12);
}

TEST(Courant, ALimitThatCannotBeKeptEndsTheRun) {
  for (const std::string speed : {"1 + 1e-9*sqrt(u + 0.9)", "1 + 3e9"}) {
    const SourceFile source("test.dpde", ring("0 .. 1, step 1/8, courant 0.5, speed " + speed));
    driver::CompileOptions options;
    options.backend = driver::Backend::jit;
    DiagnosticSink sink;
    const auto session = driver::Session::open(source, compiled(source, options), {}, sink);
    ASSERT_TRUE(session);
    EXPECT_THROW(session->rollout().run(), Error) << speed;
  }
}

/// Bit-identical for any number of checkpoints, though substeps are recomputed.
TEST(Courant, CheckpointsChangeNothing) {
  const std::string text = ring("0 .. 1, step 1/8, courant 0.4") +
                           "task t : s {\n  unknown initial u\n  unknown a\n  minimise mean(u^4)\n}\n";
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.selection.name = "t";
  options.backend = driver::Backend::jit;
  options.adjoint = true;
  const auto code = compiled(source, options);
  std::vector<double> first;
  for (const int slots : {0, 1, 2, 3, 8}) {
    DiagnosticSink sink;
    driver::SessionOptions with;
    with.slots = slots;
    const auto session = driver::Session::open(source, code, with, sink);
    ASSERT_TRUE(session);
    const GradientResult& result = session->rollout().gradient();
    std::vector<double> values = result.param_bars;
    values.resize(values.size() + 40);
    copy_out(result.state_bars[0], std::span(values).last(40));
    if (first.empty()) first = values;
    EXPECT_EQ(values, first) << slots;
  }
}

}  // namespace
}  // namespace dpde::testing
