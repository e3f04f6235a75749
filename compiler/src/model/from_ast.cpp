// SPDX-License-Identifier: Apache-2.0
// The order of the parts. All of them run, so that one pass tells all mistakes of a file.
#include "model/from_ast.h"

#include "model/boundary/falling_axes.h"
#include "model/boundary/stretch.h"
#include "model/from_ast/elaboration.h"
#include "model/from_ast/parts.h"
#include "syntax/expand/arrays.h"
#include "syntax/expand/blocks.h"
#include "syntax/expand/repeats.h"
#include "syntax/expand/whole_scenes.h"

namespace dpde::model {

namespace {

/// Arrays by their elements, scenes with all their items, programs without blocks; nullopt after a diagnostic of them.
std::optional<ast::File> written_out(const ast::File& written, DiagnosticSink& sink) {
  std::optional<ast::File> file = ast::with_elements(ast::resolve_repeats(written, sink).file, sink);
  if (file) file = ast::with_whole_scenes(std::move(*file), sink);
  if (!file) return std::nullopt;
  for (ast::Declaration& declaration : file->declarations) {
    if (auto* program = std::get_if<ast::Program>(&declaration.kind))
      program->items = ast::without_blocks(*file, program->items);
  }
  return file;
}

/// What needs all of the problem.
void check(Draft& draft) {
  check_projected_starts(draft);
  check_steady(draft);
  check_wall_weights(draft);
  check_boundary_values(draft);
  check_radiating(draft);
  if (draft.model) check_wall_formulas(draft);
  check_open_places(draft);
  check_data_times(draft);
  check_wall_derivatives(draft);
  check_settings(draft);
  check_histories(draft);
  check_waves(draft);
  if (draft.model) check_split(draft);
  check_implicit(draft);
  if (draft.model && !draft.sink.has_errors()) {  // of solves that could be read
    check_guess(draft);
    check_solve_keys(draft);
  }
  check_placements(draft);
  check_scene_lets(draft);
  check_gridless(draft);
  check_units(draft);
}

}  // namespace

std::optional<Problem> from_ast(const ast::File& written, const Selection& selection, DiagnosticSink& sink) {
  const std::optional<ast::File> whole = written_out(written, sink);
  if (!whole) return std::nullopt;
  Draft draft(*whole, selection, sink);
  if (!select(draft)) return std::nullopt;
  if (draft.model) declare_model(draft);
  if (draft.program) declare_program(draft);
  if (draft.scope.names(Role::state).empty()) return std::nullopt;
  declare_scene_lets(draft);
  mark_unknowns(draft);
  bind_parameters(draft);
  bind_scheme(draft);
  bind_grid(draft);
  bind_networks(draft);
  if (draft.model) bind_fields(draft);
  if (draft.model) bind_transports(draft);
  if (draft.model) bind_split(draft);
  bind_time(draft);
  bind_controls(draft);
  if (draft.model) bind_masks(draft);
  if (draft.model) bind_equations(draft);
  if (draft.model) bind_boundaries(draft);
  if (draft.model) bind_projections(draft);
  if (draft.program) bind_fills(draft);
  bind_states(draft);
  if (draft.model) add_histories(draft);
  bind_coefficients(draft);
  bind_subcycles(draft);
  bind_courant(draft);
  bind_step_control(draft);
  bind_observables(draft);
  bind_accuracy(draft);
  bind_outputs(draft);
  bind_shown(draft);
  bind_events(draft);
  bind_task(draft);
  if (draft.model) drop_idle_guesses(draft);
  check(draft);
  if (sink.has_errors()) return std::nullopt;
  if (draft.model) check_seams(draft);
  draft.problem = in_rising_coordinates(in_uniform_coordinates(std::move(draft.problem)));
  drop_unused(draft);
  keep_called_networks(draft);
  return std::move(draft.problem);
}

std::vector<std::string> scene_names(const ast::File& file) { return names_of<ast::Scene>(file); }

std::vector<std::string> task_names(const ast::File& file) { return names_of<ast::Task>(file); }

std::vector<std::string> scheme_names(const ast::File& file) { return names_of<ast::Scheme>(file); }

}  // namespace dpde::model
