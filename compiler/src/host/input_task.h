// SPDX-License-Identifier: Apache-2.0
// Generates the task for HostOptions::inputs as text, so that invalid unknowns are reported as in any task.
#pragma once

#include <string>

#include "dpde/dpde.h"
#include "source/diagnostic.h"
#include "source/source_file.h"

namespace dpde::host {

/// Appends to `source` a task whose unknowns are options.inputs of the scene options.name, and returns its name. Its
/// loss is a placeholder, see driver::seed_the_end(). "" after errors.
std::string append_input_task(SourceFile& source, const HostOptions& options, DiagnosticSink& sink);

}  // namespace dpde::host
