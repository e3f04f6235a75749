// SPDX-License-Identifier: Apache-2.0
// The parts of from_ast, in order of execution. Each adds its results to the elaboration's problem.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "model/analyse/placement.h"
#include "model/from_ast/elaboration.h"
#include "syntax/ast.h"

namespace dpde::model {

// select.cpp: selects the blocks; false if compilation cannot continue
bool select(Elaboration& elaboration);
/// Merges the models of a scene: a field of one model replaces coefficients of the same name in the others.
std::optional<ast::Model> coupled_model(const ast::File& file, const ast::Scene& scene);

// declarations.cpp: names of the model; after the grid its fields and coefficients, vectors by component
void declare_model(Elaboration& elaboration);
void bind_fields(Elaboration& elaboration);
// placements.cpp: placements of fields, and a check that expressions can be evaluated at theirs
/// For component `component` of a vector, or for a number (-1); cell centres if none is given or after a diagnostic.
Placement placement_of(Elaboration& elaboration, const std::optional<ast::Identifier>& on, int component);
/// The same for a scene with `axes` axes, without diagnostics.
std::optional<Placement> placement_named(const std::string& on, int component, int axes);
void check_placements(Elaboration& elaboration);
/// `where` is the position of the message if the mistake has none in the text.
void report_misplaced(Elaboration& elaboration, const Placements::Mistake& mistake, SourceRange where);
// program.cpp: the same for a hand-written program; fills give its boundaries
void declare_program(Elaboration& elaboration);
void bind_fills(Elaboration& elaboration);
/// Number of steps of the loop around the scene's program; nullptr without a loop.
const ast::Loop* find_loop(const Elaboration& elaboration);

// task.cpp: unknown parameters first; everything else later
void mark_unknowns(Elaboration& elaboration);
void bind_task(Elaboration& elaboration);
// state_maps.cpp: the lines of the task; in a comparison run of a scene with other states, formulas of the state map
// are replaced by that scene's states
std::vector<ast::Item> items_of_task(Elaboration& elaboration);
// optimiser.cpp
std::optional<Optimiser> optimiser_of(Elaboration& elaboration, const ast::UsingItem& item);

// data_times.cpp
void check_data_times(Elaboration& elaboration);
// radiating.cpp: whether radiating sides are possible, for a state or the unknown of a solve
void check_radiating(Elaboration& elaboration, const State& state);
void check_radiating(Elaboration& elaboration);
// wall_formulas.cpp: whether boundary values that are formulas of fields can be computed
void check_wall_formulas(Elaboration& elaboration);
// pole_places.cpp: reports divisions by a length that is 0 on a pole
void check_pole_places(Elaboration& elaboration);
void check_network_places(Elaboration& elaboration);
/// Whether it lies on faces some of which are poles.
bool is_on_pole(const Problem& problem, const Expr& e);
// boundary_values.cpp: whether boundary values are finite
void check_boundary_values(Elaboration& elaboration);
// seams.cpp: warns if a coordinate is read across a periodic boundary
void check_seams(Elaboration& elaboration);
// wall_derivatives.cpp
void check_wall_derivatives(Elaboration& elaboration);

// training.cpp: tasks that learn from trajectories
/// After bind_task.
void check_written_files(Elaboration& elaboration);
bool learns_from_trajectories(const Elaboration& elaboration);
bool is_training_option(const std::string& name);
/// One datum per component; nullopt for an item of another kind, empty after a diagnostic.
std::optional<std::vector<Datum>> data_of_trajectories(Elaboration& elaboration, const ast::DataItem& item);
void bind_test_on(Elaboration& elaboration, const ast::TestItem& item, Test& test);
// test_fields.cpp: fields of a spectrum or a correlation. False after a diagnostic.
bool bind_fields(Elaboration& elaboration, const ast::TestItem& item, Test& test);
void bind_training(Elaboration& elaboration);

// scheme.cpp
void bind_scheme(Elaboration& elaboration);
/// Sets the line `key = value` in `scheme`; on refusal returns the allowed words.
struct SchemeRefusal {
  bool unknown_key = false;
  std::vector<std::string> choices;
};
std::optional<SchemeRefusal> set_scheme_key(Scheme& scheme, const std::string& key, const ast::Expr& value);
const std::vector<std::string>& scheme_keys();
/// Lines for single fields; call after the fields are bound.
void bind_transports(Elaboration& elaboration);

// split.cpp
constexpr const char* split_key = "split";
/// Substeps of a split step; call after the fields are bound.
void bind_split(Elaboration& elaboration);
/// Whether the substeps cover all terms; call after the equations.
void check_split(Elaboration& elaboration);

// waves.cpp
/// Whether a spectral scheme fits the axes and equations.
void check_waves(Elaboration& elaboration);
/// Why waves along the scene's axes are not periodic; "" if they are.
std::string obstacle_to_waves(const std::vector<Axis>& axes);

// implicit_schemes.cpp
/// Whether an implicit time scheme fits the equations.
void check_implicit(Elaboration& elaboration);

// settings.cpp
/// The number set for `key`; nullopt if there is none or after a diagnostic.
std::optional<double> number_setting(Elaboration& elaboration, const std::string& key);
/// Applies scheme keys among the settings.
void apply_scheme_settings(Elaboration& elaboration);
/// Reports settings that were never queried.
void check_settings(Elaboration& elaboration);

// parameters.cpp: values of parameters in the order of the scene, overrides first
void bind_parameters(Elaboration& elaboration);

// grid.cpp
void bind_grid(Elaboration& elaboration);

// units.cpp: declared units, if there are any. Those of names first
void declare_units(Elaboration& elaboration);
/// After the axes, and again when lengths along them are known.
void measure_axes(Elaboration& elaboration);
/// After the axes, before the task.
void measure_data(Elaboration& elaboration);
/// Whether formulas agree with the declared units; call last.
void check_units(Elaboration& elaboration);

// scene_names.cpp
void declare_scene_lets(Elaboration& elaboration);
/// Checks unused ones for errors, too; call after all parts that may use them.
void check_scene_lets(Elaboration& elaboration);

// gridless.cpp
/// Whether a scene without a grid has nothing that varies in space.
void check_gridless(Elaboration& elaboration);
/// Reports `what` in a scene without a grid.
void report_no_grid(Elaboration& elaboration, const std::string& what, SourceRange range);

// networks.cpp
void bind_networks(Elaboration& elaboration);
/// network_symmetries.cpp: applies the `symmetric` line of the block to the network of `declared`.
void bind_symmetries(Elaboration& elaboration, DeclaredNetwork& declared);
/// nullptr if the file has no such network; the caller adds the name to elaboration.networks.called.
const DeclaredNetwork* find_network(const Elaboration& elaboration, const std::string& name);
/// Adds the networks that are called to the problem.
void keep_called_networks(Elaboration& elaboration);

// stretch.cpp
/// The formula of a stretched axis, with its numbers evaluated; call after all axes.
void bind_stretch(Elaboration& elaboration, const ast::Expr& formula, int axis);

/// Formulas with values of parameters substituted, which makes these parameters fixed: a grid is built only once.
Expr with_values(Elaboration& elaboration, const Expr& e);

// metric.cpp: curvilinear coordinates. Names of axes first; after the axes, the lengths
void bind_axis_names(Elaboration& elaboration);
void bind_metric(Elaboration& elaboration);
/// Converts slopes at the sides of field `name` from physical lengths to coordinates.
void measure_sides(const Elaboration& elaboration, const std::string& name, std::vector<AxisSides>& boundary);
/// Whether fields have the required conditions at poles; call after the boundaries.
void check_poles(Elaboration& elaboration);
/// True, with a diagnostic, in curvilinear coordinates.
bool is_refused_in_curves(Elaboration& elaboration, const std::string& what, SourceRange range);

// time.cpp
void bind_time(Elaboration& elaboration);
/// The Courant number, and speeds; call after the equations.
void bind_courant(Elaboration& elaboration);
/// Call after bind_courant, subcycles and transports.
void bind_step_control(Elaboration& elaboration);
/// steady.cpp: `until steady`; call after the task.
void check_steady(Elaboration& elaboration);
/// Equations with several substeps per step.
void bind_subcycles(Elaboration& elaboration);
/// Times of `at t = ...`; if `on_steps`, each must be the end of a step of this run.
When when_of(Elaboration& elaboration, const ast::When& when, bool on_steps);

/// The number of steps in `length`, if it is whole.
std::optional<double> whole_steps(double length, double step);

// outputs.cpp
void bind_outputs(Elaboration& elaboration);
/// Additional fields that the selection asks for.
void bind_shown(Elaboration& elaboration);
/// Number of steps in the interval `every` of `what`; nullopt after a diagnostic.
std::optional<int> interval_of(Elaboration& elaboration, const ast::Expr& every, const char* what);

// controls.cpp
void bind_controls(Elaboration& elaboration);
/// Values for a training sample, whose length differs from the scene's.
void bind_controls_of_windows(Elaboration& elaboration);
// masks.cpp: after the controls, on which they may depend
void bind_masks(Elaboration& elaboration);

// events.cpp
void bind_events(Elaboration& elaboration);

// equations.cpp: lets and equations
void bind_equations(Elaboration& elaboration);

/// Records that the states were given `what` at `name`; false, with a diagnostic, if one had it already.
bool is_first(Elaboration& elaboration, const std::string& what, const ast::Identifier& name,
              const std::vector<State*>& states, std::map<std::string, SourceRange>& seen);

// wall_weights.cpp: last, as it needs the initial values of unknowns
void check_wall_weights(Elaboration& elaboration);

// open_places.cpp: likewise
void check_open_places(Elaboration& elaboration);

// points.cpp
/// The position this many cells after the low end of an axis, and before the high end.
Expr place_after(const Axis& axis, int number_of_axis, double cells);
Expr place_before(const Axis& axis, int number_of_axis, double cells);

// boundaries.cpp
void bind_boundaries(Elaboration& elaboration);
/// Where the scene gives the condition of the state at x.low, ...
std::optional<SourceRange> boundary_of_side(const Elaboration& elaboration, const std::string& state,
                                            const std::string& place);
// projections.cpp: constraints
void bind_projections(Elaboration& elaboration);
void check_projected_starts(Elaboration& elaboration);
/// Of a field that the model solves for and that is not a state.
std::vector<AxisSides> boundary_of_solved(Elaboration& elaboration, const std::string& name);
/// The sides named by a boundary line or fill. `values` has one AxisSides per axis; `seen` has the positions of earlier
/// lines.
struct SidesOfField {
  std::string field;
  std::vector<AxisSides>& sides;
  std::vector<std::array<SourceRange, 2>>& seen;
};
void bind_side(Elaboration& elaboration, const ast::BoundarySide& side, SidesOfField& into);

// states.cpp: initial states, exact solutions, coefficients
void bind_states(Elaboration& elaboration);
void bind_coefficients(Elaboration& elaboration);
void bind_accuracy(Elaboration& elaboration);

// quantities.cpp
void bind_observables(Elaboration& elaboration);
/// A number of each state selected by `when`: a loss, a test, an observable.
std::optional<Expr> quantity_of(Elaboration& elaboration, const ast::Expr& e, const std::string& what,
                                const When& when = {});
/// The same for an expression already read; `whole` is its position.
std::optional<Expr> quantity_of(Elaboration& elaboration, const Expr& value, const std::string& what,
                                SourceRange whole);
/// Adds the loss whose averages are in the elaboration.
void add_loss_of_averages(Elaboration& elaboration, const Expr& value, const When& when, SourceRange range);
/// Whether an observable or test may have this name; `seen` has the names before it.
bool can_name_a_quantity(Elaboration& elaboration, const ast::Identifier& name,
                         std::map<std::string, SourceRange>& seen);

// histories.cpp: states for multistep time schemes, and their limitations
void add_histories(Elaboration& elaboration);
/// u_rate for u, or u_rate_2 if the file uses that name.
std::string name_of_memory(const Elaboration& elaboration, const std::string& of, const std::string& suffix);
void check_histories(Elaboration& elaboration);
// guesses.cpp: start values that the model gives for a solve for `name`; nullopt after a diagnostic
std::optional<std::vector<Expr>> starts_of(Elaboration& elaboration, const std::vector<ast::Expr>& starts,
                                           const std::string& name);
/// Keeps the start values if the scheme asks for them; else adds the last solutions, states of add_histories.
void add_guesses(Elaboration& elaboration, Solve& solved, const Origin& origin);
/// The same for a constraint; its solution is a state.
void add_guesses_of_constraint(Elaboration& elaboration, Solve& solved, const Origin& origin);
/// Reports an error if there are start values, for solves for increments.
void refuse_starts(Elaboration& elaboration, const Solve& solved);
/// preconditioners.cpp: the model's preconditioner, if the scheme has iterations; false after a diagnostic.
bool add_preconditioner(Elaboration& elaboration, const std::optional<ast::Expr>& written, Solve& solved);
/// Removes guesses that no step updates: solutions needed only for results are not stored.
void drop_idle_guesses(Elaboration& elaboration);
void check_guess(Elaboration& elaboration);
/// Reports settings of the scheme for cycles and iterations that no solve uses.
void check_solve_keys(Elaboration& elaboration);

// usage.cpp: removes unused items and reports them
void drop_unused(Elaboration& elaboration);

}  // namespace dpde::model
