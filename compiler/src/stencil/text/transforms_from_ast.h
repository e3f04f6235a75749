// SPDX-License-Identifier: Apache-2.0
// Reads statements such as: transform u by phi1(dt*nu*ikx^2)*dt, ... to v.
#pragma once

#include <string>
#include <vector>

#include "source/diagnostic.h"
#include "stencil/stencil.h"
#include "syntax/ast.h"

namespace dpde::stencil {

/// A multiplier with an error is returned as 0. `fields` and `rank`: those of the program.
Transform read_transform(const ast::TransformItem& source, const std::vector<std::string>& fields, std::size_t rank,
                         DiagnosticSink& sink);

}  // namespace dpde::stencil
