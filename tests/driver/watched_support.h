// SPDX-License-Identifier: Apache-2.0
// The gradient of a task with a watched run, and differences of its loss.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "dpde/runtime/unsolved.h"
#include "driver/compile/switches.h"
#include "driver/scene/inverse.h"
#include "driver_support.h"

namespace dpde::testing {

struct OpenTask {
  std::unique_ptr<driver::Session> session;
  std::unique_ptr<driver::Inverse> inverse;
};

inline std::optional<OpenTask> open_task(const SourceFile& source, bool forced, driver::Backend backend) {
  driver::CompileOptions options;
  options.selection.name = "t";
  options.adjoint = true;
  options.takes_jumps = options.trusts_signs = forced;
  options.backend = backend;
  DiagnosticSink sink;
  auto compiled = driver::compile(source, options, sink);
  EXPECT_TRUE(compiled) << all_messages(source, sink);
  if (!compiled) return std::nullopt;
  OpenTask run;
  run.session = driver::Session::open(source, std::make_shared<const driver::Compiled>(std::move(*compiled)), {}, sink);
  if (run.session) run.inverse = driver::Inverse::open(*run.session, source, sink);
  EXPECT_TRUE(run.inverse) << all_messages(source, sink);
  return run.inverse ? std::optional(std::move(run)) : std::nullopt;
}

struct FoundGradient {
  bool is_refused = false;
  double gradient = NAN;  // with --force
  double secant = NAN;    // over several steps around p = 0
  bool is_wrong() const { return std::abs(gradient - secant) > 0.05 * std::abs(secant) + 1e-4; }
};

inline FoundGradient gradient_of(const std::string& text) {
  const SourceFile source("signs.dpde", text);
  FoundGradient found;
  Eigen::VectorXd gradient(1);
  const auto watched = open_task(source, false, driver::Backend::interpreter);
  if (!watched) return found;
  try {
    watched->inverse->value_and_gradient(watched->inverse->start(), gradient);
  } catch (const Unsolved& error) {
    found.is_refused = error.facts().what == UnsolvedFacts::What::jump;
  }
  const auto forced = open_task(source, true, driver::Backend::interpreter);
  if (!forced) return found;
  const double k = forced->inverse->start()[0], apart = 0.02;
  forced->inverse->value_and_gradient(forced->inverse->start(), gradient);
  const auto loss = [&](double at) { return forced->inverse->value(Eigen::VectorXd::Constant(1, at)); };
  found.gradient = gradient[0];
  found.secant = (loss(k + apart) - loss(k - apart)) / (2 * apart);
  return found;
}

}  // namespace dpde::testing
