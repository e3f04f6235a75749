// SPDX-License-Identifier: Apache-2.0
// A test beside a scene of other states says how these are made of the task's: beside vortex where omega = curl(u).
#pragma once

#include <string>
#include <vector>

#include "model/model.h"
#include "source/diagnostic.h"
#include "syntax/ast.h"

namespace dpde::model {

using StateMap = std::vector<ast::NamedFormula>;

/// What the tests of the task say of the scene: all of them the same, else it is reported; none where nothing is said.
StateMap state_map_of(const ast::Task& task, const std::string& scene, DiagnosticSink& sink);
/// The same of a file, whose arrays are written out, for each state of `there` that it makes: placed as that is.
/// Reports what is no field of that scene.
StateMap state_map_to(const Problem& there, const ast::File& file, const std::string& task, DiagnosticSink& sink);
/// The states of `there` that a name stands for: itself, or the components of a vector.
std::vector<const State*> states_called(const Problem& there, const std::string& name);

}  // namespace dpde::model
