// SPDX-License-Identifier: Apache-2.0
// Expressions of kernels and of boundary values. What a name means is the scope's to say; operators, functions and
// numbers are the same everywhere.
#pragma once

#include <string>
#include <vector>

#include "source/diagnostic.h"
#include "stencil/stencil.h"
#include "syntax/ast.h"

namespace dpde::stencil {

/// Offsets and grown regions beyond this are errors: every cell of them is memory around each field.
constexpr int max_distance = 1000;

/// A hint; empty where no candidate is near.
std::string did_you_mean(const std::string& name, const std::vector<std::string>& candidates);

class ExprReader {
 public:
  explicit ExprReader(DiagnosticSink& sink) : sink_(sink) {}
  virtual ~ExprReader() = default;

  /// What was reported comes back as 0, and nothing further is said about it.
  Expr read(const ast::Expr& e);

 protected:
  virtual Expr read_name(const std::string& name, SourceRange range) = 0;
  virtual Expr read_offsets(const ast::Offsets& offsets, SourceRange range) = 0;
  virtual Expr read_interp(const ast::Call& call, SourceRange range) = 0;
  /// Of a function that is none.
  virtual Expr read_unknown(const ast::Call& call, SourceRange range);

  DiagnosticSink& sink() { return sink_; }
  /// Reports a wrong number of arguments.
  bool has_arguments(const ast::Call& call, std::size_t count, SourceRange range);

 private:
  Expr read_call(const ast::Call& call, SourceRange range);
  bool are_positional(const ast::Call& call);

  DiagnosticSink& sink_;
};

/// Reports `cells` outside of least .. max_distance.
bool check_distance(int cells, int least, SourceRange range, DiagnosticSink& sink);

}  // namespace dpde::stencil
