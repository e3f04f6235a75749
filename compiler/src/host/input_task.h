// SPDX-License-Identifier: Apache-2.0
// The task behind HostOptions::inputs. It is text, so that what cannot be an unknown is refused as in any task.
#pragma once

#include <string>

#include "dpde/dpde.h"
#include "source/diagnostic.h"
#include "source/source_file.h"

namespace dpde::host {

/// Puts a task behind `source` that seeks options.inputs of the scene options.name, and gives its name. Its loss stands
/// for another, driver::seed_the_end(). "" after errors.
std::string append_input_task(SourceFile& source, const HostOptions& options, DiagnosticSink& sink);

}  // namespace dpde::host
