// SPDX-License-Identifier: Apache-2.0
// The scene of a command, without its task, ready to run.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "command.h"
#include "driver/scene/session.h"

namespace dpde::tools {

/// `overrides` beside those of --set. null after an error in `sink`.
std::unique_ptr<driver::Session> open_scene(Job& job, DiagnosticSink& sink,
                                            const std::map<std::string, std::string>& overrides = {});
/// The scene that the options select.
std::unique_ptr<driver::Session> open_scene(Job& job, driver::CompileOptions options, DiagnosticSink& sink);

/// Whether the exact solutions are finite where the scene ends; else a diagnostic.
bool has_finite_exact(driver::Session& session, DiagnosticSink& sink);

}  // namespace dpde::tools
