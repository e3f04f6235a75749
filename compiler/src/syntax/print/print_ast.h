// SPDX-License-Identifier: Apache-2.0
// The canonical text of an ast: `dpde fmt` and stage `ast`. Comments are kept, parentheses are the fewest that keep
// the tree, numbers stay as written. print(parse(print(parse(t)))) == print(parse(t)).
#pragma once

#include <string>

#include "syntax/ast.h"

namespace dpde::ast {

std::string print(const File& file);
std::string print(const Expr& expr);

}  // namespace dpde::ast
