// SPDX-License-Identifier: Apache-2.0
// State maps: a comparison run of a scene with other states computes these from the task's states, as in "beside vortex
// where omega = curl(u)".
#pragma once

#include <string>
#include <vector>

#include "model/model.h"
#include "source/diagnostic.h"
#include "syntax/ast.h"

namespace dpde::model {

using StateMap = std::vector<ast::NamedFormula>;

/// The map that the task's tests give for the scene; empty if none. Reports an error if the tests give different maps.
StateMap state_map_of(const ast::Task& task, const std::string& scene, DiagnosticSink& sink);
/// The map of a file with expanded arrays, for each state of `there` that it computes, at that state's placement.
/// Reports names that are not fields of that scene.
StateMap state_map_to(const Problem& there, const ast::File& file, const std::string& task, DiagnosticSink& sink);
/// The states of `there` with this name: one, or the components of a vector.
std::vector<const State*> states_called(const Problem& there, const std::string& name);

}  // namespace dpde::model
