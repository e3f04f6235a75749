// SPDX-License-Identifier: Apache-2.0
// From a text to a problem, with the diagnostics as "E0301 line".
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "model/from_ast.h"
#include "model/print/print_model.h"
#include "model/verify_model.h"
#include "source/diagnostic.h"
#include "source/source_file.h"
#include "syntax/parser.h"

namespace dpde::model {

struct Outcome {
  std::optional<Problem> problem;
  std::vector<Diagnostic> diagnostics;

  /// "E0301 did you mean u?" of the only diagnostic, else all codes.
  std::string code_and_hint() const {
    if (diagnostics.size() == 1) return std::string(diagnostics[0].kind->code) + " " + diagnostics[0].hint;
    std::string codes = std::to_string(diagnostics.size()) + " diagnostics:";
    for (const Diagnostic& d : diagnostics) codes += " " + std::string(d.kind->code) + " " + d.message + ";";
    return codes;
  }
};

inline Outcome outcome_of(const std::string& text, const Selection& selection = {}) {
  const SourceFile source("test.dpde", text);
  DiagnosticSink sink;
  const ast::File file = ast::parse(source, sink);
  EXPECT_FALSE(sink.has_errors()) << sink.all().front().message;
  Outcome outcome{from_ast(file, selection, sink), {}};
  outcome.diagnostics = sink.all();
  EXPECT_EQ(outcome.problem.has_value(), !sink.has_errors());
  if (outcome.problem) {
    EXPECT_EQ(verify(*outcome.problem), std::vector<std::string>{});
  }
  return outcome;
}

/// Message, code and hint of the only diagnostic with these settings; "" where there is none.
inline std::string refusal_of(const std::string& text, const std::map<std::string, std::string>& settings = {}) {
  Selection selection;
  selection.overrides = settings;
  const Outcome outcome = outcome_of(text, selection);
  return outcome.problem ? "" : outcome.diagnostics.front().message + ": " + outcome.code_and_hint();
}

/// Message and hint of a text with one mistake.
inline std::string message(const std::string& text) {
  const Outcome outcome = outcome_of(text);
  if (outcome.diagnostics.size() != 1) return outcome.code_and_hint();
  return outcome.diagnostics[0].message + " | " + outcome.diagnostics[0].hint;
}

/// Of a text without errors.
inline Problem problem_of(const std::string& text, const Selection& selection = {}) {
  Outcome outcome = outcome_of(text, selection);
  for (const Diagnostic& d : outcome.diagnostics)
    EXPECT_EQ(d.kind->severity, Severity::warning) << d.message << "\n" << d.hint;
  if (!outcome.problem) throw std::runtime_error("the text has errors");
  return *outcome.problem;
}

/// The model m with field u, params k, c and coefficient w in a scene with as many axes.
inline std::string text_with(const std::string& rhs, int axes = 1, const std::string& scene_lines = "",
                             const std::string& model_lines = "") {
  std::string text =
      "model m {\n  field u\n  param k, c\n  coefficient w\n" + model_lines + "  dt(u) = " + rhs + "\n}\n";
  text += "scene s : m {\n";
  for (int axis = 0; axis < axes; ++axis)
    text += std::string("  grid ") + "xyz"[axis] + " = 0 .. 1, cells 8, periodic\n";
  return text + "  k = 2\n  c = 3\n  w = 1 + x\n  initial u = 0\n  time 0 .. 1, step 1/8\n" + scene_lines + "}\n";
}

/// The right-hand side of u's equation as text.
inline std::string rhs_of(const std::string& rhs, int axes = 1, const std::string& model_lines = "") {
  return print(*problem_of(text_with(rhs, axes, "", model_lines)).states.at(0).rhs);
}

}  // namespace dpde::model
