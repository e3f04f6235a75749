// SPDX-License-Identifier: Apache-2.0
// Compiles model texts for tests; error diagnostics fail the running test.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

#include "analysis/certificate/certificate.h"
#include "codegen/llvm/jit.h"
#include "driver/compile/links.h"
#include "driver/compile/pipeline.h"
#include "loop/from_stencil.h"
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

/// The first error of the gradient of task t, including errors that a run would report when a watched condition
/// switches; "" if none.
inline std::string code_refused(const std::string& text, bool takes_jumps = false) {
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.selection.name = "t";
  options.adjoint = true;
  options.takes_jumps = options.trusts_signs = takes_jumps;
  DiagnosticSink sink;
  const auto compiled = driver::compile(source, options, sink);
  if (compiled && std::ranges::any_of(compiled->watched, &driver::Watched::is_switch)) return "E0609";
  for (const Diagnostic& d : sink.all()) {
    if (d.kind->severity != Severity::error) continue;
    EXPECT_TRUE(d.range.is_known()) << all_messages(source, sink);
    return std::string(d.kind->code);
  }
  return "";
}

/// Recompiles the current stencil programs, for tests that modify them after compilation.
inline void compile_stencil_again(driver::Compiled& scene) {
  std::vector<std::string> names;
  for (const stencil::Program& program : scene.stencil.programs) names.push_back(program.name);
  driver::replace_loop(scene, loop::from_stencil(scene.stencil, names));
  scene.code = codegen::jit(scene.loop).module;
  for (const driver::LinkedProgram& linked : driver::linked_programs(scene)) {
    scene.code->set_links(linked.program, linked.links);
  }
}

/// The result of certify() for task t of the text, with or without second derivatives; a diagnostic fails the running
/// test.
inline std::optional<analysis::Certificate> certificate_of(const std::string& text, bool second) {
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.selection.name = "t";
  options.backend = driver::Backend::jit;
  options.tangent = options.adjoint = true;
  options.second = second;
  const auto code = compiled(source, options);
  if (!code) return std::nullopt;
  DiagnosticSink sink;
  std::optional<analysis::Certificate> certificate = analysis::certify(source, code, {}, sink);
  EXPECT_TRUE(certificate) << all_messages(source, sink);
  return certificate;
}

/// Dot products to 1e-12 and a Taylor slope of 2; with `second` also the Hessian.
inline void expect_certified(const std::string& text, bool second) {
  const auto certificate = certificate_of(text, second);
  ASSERT_TRUE(certificate);
  EXPECT_TRUE(certificate->passed());
  EXPECT_LT(certificate->worst(), 1e-12);
  EXPECT_NEAR(certificate->slope.value_or(0), 2, 0.05);
  if (!second) return;
  ASSERT_TRUE(certificate->second);
  EXPECT_TRUE(certificate->second->passed());
}

/// Square cells of width 1/40.
inline std::string grid(const std::string& axis, int cells, bool periodic = true) {
  return "grid " + axis + " = 0 .. " + std::to_string(cells) + "/40, cells " + std::to_string(cells) +
         (periodic ? ", periodic\n" : "\n");
}

}  // namespace dpde::testing
