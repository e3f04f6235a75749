// SPDX-License-Identifier: Apache-2.0
// Renames fields in a text.
#pragma once

#include <functional>
#include <string>

#include "syntax/ast.h"

namespace dpde::ast {

using Rename = std::function<std::string(const std::string&)>;

/// `e` with every value name renamed; names of functions stay.
Expr rename(const Expr& e, const Rename& field);
/// The kernel with its parameters renamed, also in the body. Inputs that become one field are merged into one
/// parameter.
Kernel rename(Kernel kernel, const Rename& field);

}  // namespace dpde::ast
