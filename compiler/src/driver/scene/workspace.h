// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "codegen/compiled_module.h"
#include "dpde/runtime/workspace.h"
#include "model/model.h"

namespace dpde::driver {

/// A workspace for every program of `code`, with what the problem says of parameters, controls, noise and networks.
/// `cells`: one number an axis, in place of the scene's; empty: the scene's.
Workspace make_workspace(const model::Problem& problem, const codegen::CompiledModule& code,
                         const std::vector<int>& cells);

}  // namespace dpde::driver
