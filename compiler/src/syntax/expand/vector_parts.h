// SPDX-License-Identifier: Apache-2.0
// Expands lines of a scene about a whole vector, `initial u = (1, 0)`, to lines about its components.
#pragma once

#include <string>
#include <vector>

#include "syntax/ast.h"

namespace dpde::ast {

/// Name and value that a line sets; both nullptr if it sets nothing; no value for a boundary.
struct Given {
  Identifier* name = nullptr;
  Expr* value = nullptr;
};
Given given_by(Item& item);

/// "u" for u.x, "dt(u)" for dt(u.x); "" if the name is no component.
std::string whole_of(const std::string& name);

/// One line for each axis. A line that reads a file has no parts and stays.
std::vector<Item> parts_of(const Item& item, const std::vector<std::string>& axes);

}  // namespace dpde::ast
