// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "codegen/compiled_module.h"
#include "dpde/runtime/workspace.h"
#include "model/model.h"

namespace dpde::driver {

/// Creates a workspace for every program of `code`, with the problem's parameters, controls, noise and networks.
/// `cells`: overrides the scene's cell counts, one for each axis; empty: the scene's.
Workspace make_workspace(const model::Problem& problem, const codegen::CompiledModule& code,
                         const std::vector<int>& cells);

}  // namespace dpde::driver
