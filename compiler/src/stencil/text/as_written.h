// SPDX-License-Identifier: Apache-2.0
// Names and source ranges for messages, as the user wrote them: repeats rename kernels and fields internally.
#pragma once

#include <string>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// A text about the program, with the names that the user wrote.
std::string as_written(const Module& module, const Program& program, const std::string& text);

/// Source range of the kernel's computation or its beginning; an empty range if the module has no such kernel.
SourceRange place_of(const Module& module, const std::string& kernel);

}  // namespace dpde::stencil
