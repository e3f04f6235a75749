// SPDX-License-Identifier: Apache-2.0
// Expressions of kernels and of boundary values. Derived classes give names their meaning; operators, functions and
// numbers are read here.
#pragma once

#include <string>
#include <vector>

#include "source/diagnostic.h"
#include "stencil/stencil.h"
#include "syntax/ast.h"

namespace dpde::stencil {

/// Larger offsets and values of `grow` are errors: each such cell is memory around every field.
constexpr int max_distance = 1000;

/// A hint with a similar name; empty if no candidate is similar.
std::string did_you_mean(const std::string& name, const std::vector<std::string>& candidates);

class ExprReader {
 public:
  explicit ExprReader(DiagnosticSink& sink) : sink_(sink) {}
  virtual ~ExprReader() = default;

  /// Returns 0 for an expression with an error, so that the error is reported once only.
  Expr read(const ast::Expr& e);

 protected:
  virtual Expr read_name(const std::string& name, SourceRange range) = 0;
  virtual Expr read_offsets(const ast::Offsets& offsets, SourceRange range) = 0;
  virtual Expr read_interp(const ast::Call& call, SourceRange range) = 0;
  /// Handles a call of an unknown function.
  virtual Expr read_unknown(const ast::Call& call, SourceRange range);

  DiagnosticSink& sink() { return sink_; }
  /// Reports a wrong number of arguments.
  bool has_arguments(const ast::Call& call, std::size_t count, SourceRange range);

 private:
  Expr read_call(const ast::Call& call, SourceRange range);
  bool are_positional(const ast::Call& call);

  DiagnosticSink& sink_;
};

/// Reports an error if `cells` is outside of least .. max_distance.
bool check_distance(int cells, int least, SourceRange range, DiagnosticSink& sink);

}  // namespace dpde::stencil
