// SPDX-License-Identifier: Apache-2.0
// transform u by phi1(dt*nu*ikx^2)*dt, ... to v, as a person writes it.
#pragma once

#include <string>
#include <vector>

#include "source/diagnostic.h"
#include "stencil/stencil.h"
#include "syntax/ast.h"

namespace dpde::stencil {

/// A multiplier of which something was reported comes back as 0. `fields`: those of the program, whose `rank` it has.
Transform read_transform(const ast::TransformItem& source, const std::vector<std::string>& fields, std::size_t rank,
                         DiagnosticSink& sink);

}  // namespace dpde::stencil
