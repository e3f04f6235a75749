// SPDX-License-Identifier: Apache-2.0
// The text of stencil programs, in the syntax a person writes them in: print(from_ast(parse(print(m)))) == print(m).
// Parentheses are the fewest that keep the tree, numbers the shortest that read back exactly.
#pragma once

#include <string>

#include "stencil/stencil.h"

namespace dpde::stencil {

std::string print(const Module& module);
std::string print(const Kernel& kernel);
std::string print(const Program& program);
std::string print(const Loop& loop);
/// One expression at a grid of `rank` axes (a field at offset 0 is its bare name).
std::string print(const Expr& e, int rank);

}  // namespace dpde::stencil
