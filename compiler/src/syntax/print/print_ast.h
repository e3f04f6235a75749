// SPDX-License-Identifier: Apache-2.0
// The canonical text of an ast, for `dpde fmt` and stage `ast`. Comments are kept, parentheses are minimal, numbers
// stay as written. print(parse(print(parse(t)))) == print(parse(t)).
#pragma once

#include <string>

#include "syntax/ast.h"

namespace dpde::ast {

std::string print(const File& file);
std::string print(const Expr& expr);

}  // namespace dpde::ast
