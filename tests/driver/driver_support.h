// SPDX-License-Identifier: Apache-2.0
// Compiles model texts for tests; diagnostics of error severity fail the running test.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "driver/pipeline.h"
#include "source/render.h"

namespace dpde::testing {

inline std::string all_messages(const SourceFile& source, const DiagnosticSink& sink) {
  std::string text;
  for (const Diagnostic& d : sink.all()) text += render_text(source, d);
  return text;
}

inline std::shared_ptr<driver::Compiled> compiled(const SourceFile& source, driver::CompileOptions options) {
  DiagnosticSink sink;
  options.verify = true;
  std::optional<driver::Compiled> result = driver::compile(source, options, sink);
  EXPECT_TRUE(result.has_value()) << all_messages(source, sink);
  return result ? std::make_shared<driver::Compiled>(std::move(*result)) : nullptr;
}

}  // namespace dpde::testing
