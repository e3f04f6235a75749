// SPDX-License-Identifier: Apache-2.0
// From the text's tree to one problem: a scene, or a task with its scene, with the model, the scheme and the settings
// of the command line put in. All names are resolved, all expressions typed, all numbers of the scene evaluated.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "model/model.h"
#include "source/diagnostic.h"
#include "syntax/ast.h"

namespace dpde::model {

/// What of a file is meant. The scheme is the one named here, else the task's, else the scene's, else the first of the
/// file, else Scheme{}.
struct Selection {
  std::string name;                              // a scene or a task; "": the only task, else the only scene
  std::map<std::string, std::string> overrides;  // --set: parameters, cells, cells.x, step, end, real, scheme keys
  std::string scheme;                            // "" or the name of a scheme
  bool keeps_params = false;                     // hosts set parameters later: none may be folded into the equations
  std::string beside;  // a scene that the task's tests name: in place of its own, with nothing of the task but data and
                       // these tests
  std::vector<ast::NamedFormula> shown = {};  // what a run keeps beside what its outputs ask for
};

/// The selected problem; nullopt when there are errors in `sink` afterwards.
std::optional<Problem> from_ast(const ast::File& file, const Selection& selection, DiagnosticSink& sink);

/// Whether no two blocks that are chosen by name share one; reports those that do, and functions with names of built-in
/// ones.
bool check_block_names(const ast::File& file, DiagnosticSink& sink);

/// The scheme with these rows in the place of its own; what does not fit is passed over.
Scheme with_settings(Scheme scheme, const std::map<std::string, std::string>& rows);

/// In the order of the file.
std::vector<std::string> scene_names(const ast::File& file);
std::vector<std::string> task_names(const ast::File& file);
std::vector<std::string> scheme_names(const ast::File& file);

}  // namespace dpde::model
