// SPDX-License-Identifier: Apache-2.0
// Source range of a scene's or task's declaration, for messages about the whole of it.
#pragma once

#include <string>

#include "source/source_file.h"

namespace dpde::driver {

/// Range of the task's name in its declaration; of the scene's name if there is no such task.
SourceRange place_of(const SourceFile& source, const std::string& scene, const std::string& task = "");

}  // namespace dpde::driver
