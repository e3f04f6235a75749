// SPDX-License-Identifier: Apache-2.0
// The text of stencil programs, in the input syntax: print(from_ast(parse(print(m)))) == print(m). Uses the fewest
// parentheses that keep the tree, and the shortest numbers that read back exactly.
#pragma once

#include <string>

#include "stencil/stencil.h"

namespace dpde::stencil {

std::string print(const Module& module);
std::string print(const Kernel& kernel);
std::string print(const Program& program);
std::string print(const Loop& loop);
/// One expression on a grid of `rank` axes (a field at offset 0 is printed as its name).
std::string print(const Expr& e, int rank);

}  // namespace dpde::stencil
