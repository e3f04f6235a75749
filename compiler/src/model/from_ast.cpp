// SPDX-License-Identifier: Apache-2.0
// The order of the parts. All of them run, so that one pass reports all errors of a file.
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

/// Arrays expanded to their elements, scenes with all their items, programs without blocks; nullopt after an error.
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

/// Checks that need the whole problem.
void check(Elaboration& elaboration) {
  check_projected_starts(elaboration);
  check_steady(elaboration);
  check_wall_weights(elaboration);
  check_boundary_values(elaboration);
  check_radiating(elaboration);
  if (elaboration.blocks.model) check_wall_formulas(elaboration);
  check_open_places(elaboration);
  check_data_times(elaboration);
  check_wall_derivatives(elaboration);
  check_settings(elaboration);
  check_histories(elaboration);
  check_waves(elaboration);
  if (elaboration.blocks.model) check_split(elaboration);
  check_implicit(elaboration);
  if (elaboration.blocks.model && !elaboration.sink.has_errors()) {  // of solves without errors
    check_guess(elaboration);
    check_solve_keys(elaboration);
  }
  check_placements(elaboration);
  check_scene_lets(elaboration);
  check_gridless(elaboration);
  check_units(elaboration);
}

}  // namespace

std::optional<Problem> from_ast(const ast::File& written, const Selection& selection, DiagnosticSink& sink) {
  const std::optional<ast::File> whole = written_out(written, sink);
  if (!whole) return std::nullopt;
  Elaboration elaboration(*whole, selection, sink);
  if (!select(elaboration)) return std::nullopt;
  if (elaboration.blocks.model) declare_model(elaboration);
  if (elaboration.blocks.program) declare_program(elaboration);
  if (elaboration.names.scope.names(Role::state).empty()) return std::nullopt;
  declare_scene_lets(elaboration);
  declare_units(elaboration);
  mark_unknowns(elaboration);
  bind_parameters(elaboration);
  bind_scheme(elaboration);
  bind_grid(elaboration);
  measure_axes(elaboration);
  measure_data(elaboration);
  bind_networks(elaboration);
  if (elaboration.blocks.model) bind_fields(elaboration);
  if (elaboration.blocks.model) bind_transports(elaboration);
  if (elaboration.blocks.model) bind_split(elaboration);
  bind_time(elaboration);
  bind_controls(elaboration);
  if (elaboration.blocks.model) bind_masks(elaboration);
  if (elaboration.blocks.model) bind_equations(elaboration);
  if (elaboration.blocks.model) bind_boundaries(elaboration);
  if (elaboration.blocks.model) bind_projections(elaboration);
  if (elaboration.blocks.program) bind_fills(elaboration);
  bind_states(elaboration);
  if (elaboration.blocks.model) add_histories(elaboration);
  bind_coefficients(elaboration);
  bind_subcycles(elaboration);
  bind_courant(elaboration);
  bind_step_control(elaboration);
  bind_observables(elaboration);
  bind_accuracy(elaboration);
  bind_outputs(elaboration);
  bind_shown(elaboration);
  bind_events(elaboration);
  bind_task(elaboration);
  if (elaboration.blocks.model) drop_idle_guesses(elaboration);
  check(elaboration);
  if (sink.has_errors()) return std::nullopt;
  if (elaboration.blocks.model) check_seams(elaboration);
  elaboration.problem = in_rising_coordinates(in_uniform_coordinates(std::move(elaboration.problem)));
  drop_unused(elaboration);
  keep_called_networks(elaboration);
  return std::move(elaboration.problem);
}

std::vector<std::string> scene_names(const ast::File& file) { return names_of<ast::Scene>(file); }

std::vector<std::string> task_names(const ast::File& file) { return names_of<ast::Task>(file); }

std::vector<std::string> scheme_names(const ast::File& file) { return names_of<ast::Scheme>(file); }

}  // namespace dpde::model
