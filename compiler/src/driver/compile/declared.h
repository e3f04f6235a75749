// SPDX-License-Identifier: Apache-2.0
// Where a scene or a task is declared, for messages about all of it.
#pragma once

#include <string>

#include "source/source_file.h"

namespace dpde::driver {

/// The name of the task where it is declared, or that of the scene where there is none of the task's name.
SourceRange place_of(const SourceFile& source, const std::string& scene, const std::string& task = "");

}  // namespace dpde::driver
