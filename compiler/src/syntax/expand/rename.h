// SPDX-License-Identifier: Apache-2.0
// Other fields in the place of those that a text names.
#pragma once

#include <functional>
#include <string>

#include "syntax/ast.h"

namespace dpde::ast {

using Rename = std::function<std::string(const std::string&)>;

/// `e` with every name that stands for a value renamed; functions keep theirs.
Expr rename(const Expr& e, const Rename& field);
/// The kernel with the names of its parameters renamed, in the body too. Inputs that become one field are one
/// parameter.
Kernel rename(Kernel kernel, const Rename& field);

}  // namespace dpde::ast
