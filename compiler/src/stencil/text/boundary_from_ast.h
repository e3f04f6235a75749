// SPDX-License-Identifier: Apache-2.0
// Sides and values of boundary conditions in fills.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stencil/text/expr_from_ast.h"

namespace dpde::stencil {

constexpr std::string_view axis_letters = "xyz";

bool is_name(const ast::Expr& e, std::string_view name);

/// Boundary values: params, numbers and functions of them.
class BoundaryValueReader : public ExprReader {
 public:
  BoundaryValueReader(const std::vector<std::string>& fields, const char* statement, DiagnosticSink& sink)
      : ExprReader(sink), fields_(fields), statement_(statement) {}

 private:
  Expr read_name(const std::string& name, SourceRange range) override;
  Expr read_offsets(const ast::Offsets& offsets, SourceRange range) override { return refuse(offsets.name, range); }
  Expr read_interp(const ast::Call& call, SourceRange range) override { return refuse(call.callee, range); }
  Expr refuse(const std::string& name, SourceRange range);

  const std::vector<std::string>& fields_;
  const char* statement_;
};

/// The axis and sides that a text such as "y.low" names.
struct Place {
  int axis = -1;  // -1: all axes
  bool low = true, high = true;
};
std::optional<Place> place_of(const std::string& text);

}  // namespace dpde::stencil
