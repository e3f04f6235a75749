// SPDX-License-Identifier: Apache-2.0
// Opens the scene of a command, without its task.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "command.h"
#include "driver/scene/session.h"

namespace dpde::tools {

/// `overrides` in addition to those of --set. Returns null after an error in `sink`.
std::unique_ptr<driver::Session> open_scene(Job& job, DiagnosticSink& sink,
                                            const std::map<std::string, std::string>& overrides = {});
/// Opens the scene that the options select.
std::unique_ptr<driver::Session> open_scene(Job& job, driver::CompileOptions options, DiagnosticSink& sink);

/// Whether the exact solutions are finite at the end of the scene; otherwise adds a diagnostic.
bool has_finite_exact(driver::Session& session, DiagnosticSink& sink);

}  // namespace dpde::tools
