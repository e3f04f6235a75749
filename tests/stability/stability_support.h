// SPDX-License-Identifier: Apache-2.0
// What tests of stability share: scenes from a text, and the symbols of differences by hand.
#pragma once

#include <gtest/gtest.h>

#include <complex>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "driver/scene/session.h"
#include "support/kept_code.h"

namespace dpde::stability {

/// The scene s, compiled by the JIT; any diagnostic fails the running test.
inline std::unique_ptr<driver::Session> open_scene(const std::string& text) {
  const SourceFile source("test.dpde", text);
  DiagnosticSink sink;
  driver::CompileOptions options;
  options.selection.name = "s";
  options.backend = driver::Backend::jit;
  options.cache = testing::kept_code();
  std::optional<driver::Compiled> compiled = driver::compile(source, options, sink);
  for (const Diagnostic& d : sink.all()) ADD_FAILURE() << d.message << "\n" << text;
  return driver::Session::open(source, std::make_shared<driver::Compiled>(std::move(compiled).value()), {}, sink);
}

/// A difference on cells of 1.
struct Difference {
  int first;  // cell of the first weight
  std::vector<double> weights;
  double bottom;
  /// What it makes of the wave of this angle.
  std::complex<double> of(double angle) const {
    std::complex<double> sum = 0;
    for (std::size_t i = 0; i < weights.size(); ++i)
      sum += weights[i] / bottom * std::polar(1.0, angle * (first + static_cast<double>(i)));
    return sum;
  }
};

}  // namespace dpde::stability
