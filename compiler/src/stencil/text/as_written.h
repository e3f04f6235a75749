// SPDX-License-Identifier: Apache-2.0
// Names and places for messages: a person knows nothing of what repeats call kernels and fields.
#pragma once

#include <string>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// Text about the program in the words of who wrote it.
std::string as_written(const Module& module, const Program& program, const std::string& text);

/// Where the kernel computes something, or begins; nowhere where the module has none of this name.
SourceRange place_of(const Module& module, const std::string& kernel);

}  // namespace dpde::stencil
