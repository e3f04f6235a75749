// SPDX-License-Identifier: Apache-2.0
// Lines of a scene about a whole vector, `initial u = (1, 0)`, as lines about its components.
#pragma once

#include <string>
#include <vector>

#include "syntax/ast.h"

namespace dpde::ast {

/// What a line gives, and to what; nullptr of a line that gives nothing, and for the value of a boundary.
struct Given {
  Identifier* name = nullptr;
  Expr* value = nullptr;
};
Given given_by(Item& item);

/// "u" of u.x, "dt(u)" of dt(u.x); "" where the name is that of no component.
std::string whole_of(const std::string& name);

/// One line for each axis; the line itself where it reads a file, which has no parts.
std::vector<Item> parts_of(const Item& item, const std::vector<std::string>& axes);

}  // namespace dpde::ast
