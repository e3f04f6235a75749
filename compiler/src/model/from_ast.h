// SPDX-License-Identifier: Apache-2.0
// From the syntax tree to one problem: a scene, or a task with its scene, combined with the model, the scheme and the
// settings of the command line. All names are resolved, all expressions typed, all numbers of the scene evaluated.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "model/model.h"
#include "source/diagnostic.h"
#include "syntax/ast.h"

namespace dpde::model {

/// Selects the scene or task of a file. The scheme is the one named here, else the task's, else the scene's, else the
/// first of the file, else Scheme{}.
struct Selection {
  std::string name;                              // a scene or a task; "": the only task, else the only scene
  std::map<std::string, std::string> overrides;  // --set: parameters, cells, cells.x, step, end, real, scheme keys
  std::string scheme;                            // "" or the name of a scheme
  bool keeps_params = false;                     // host programs set parameters later, so none are folded
  std::string beside;  // a scene that the task's tests name; replaces the task's own, with only data and these tests
  std::vector<ast::NamedFormula> shown = {};  // additional output fields of a run
};

/// The selected problem; nullopt if `sink` has errors afterwards.
std::optional<Problem> from_ast(const ast::File& file, const Selection& selection, DiagnosticSink& sink);

/// Whether block names are unique. Reports duplicates, and functions with names of built-in functions.
bool check_block_names(const ast::File& file, DiagnosticSink& sink);

/// The scheme with these settings changed; settings that do not fit are ignored.
Scheme with_settings(Scheme scheme, const std::map<std::string, std::string>& rows);

/// In file order.
std::vector<std::string> scene_names(const ast::File& file);
std::vector<std::string> task_names(const ast::File& file);
std::vector<std::string> scheme_names(const ast::File& file);

}  // namespace dpde::model
