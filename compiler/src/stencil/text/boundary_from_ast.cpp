// SPDX-License-Identifier: Apache-2.0
#include "stencil/text/boundary_from_ast.h"

#include <algorithm>

#include "stencil/build.h"

namespace dpde::stencil {

bool is_name(const ast::Expr& e, std::string_view name) {
  const auto* found = std::get_if<ast::Name>(&e->kind);
  return found && found->name == name;
}

Expr BoundaryValueReader::read_name(const std::string& name, SourceRange range) {
  if (std::find(fields_.begin(), fields_.end(), name) != fields_.end()) return refuse(name, range);
  return name == "pi" ? Expr(3.14159265358979323846) : param(name);
}

Expr BoundaryValueReader::refuse(const std::string& name, SourceRange range) {
  sink().report("boundary-value-varies", range, {name, statement_},
                "store the values in a field by a kernel, and let the field stand alone");
  return 0.0;
}

std::optional<Place> place_of(const std::string& text) {
  if (text == "all") return Place{};
  const std::size_t axis = text.empty() ? std::string::npos : axis_letters.find(text[0]);
  if (axis == std::string::npos) return std::nullopt;
  const std::string side = text.substr(1);
  if (!side.empty() && side != ".low" && side != ".high") return std::nullopt;
  return Place{static_cast<int>(axis), side != ".high", side != ".low"};
}

}  // namespace dpde::stencil
