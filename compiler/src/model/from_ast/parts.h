// SPDX-License-Identifier: Apache-2.0
// The parts of from_ast, in the order in which they run. Each puts its share into the elaboration's problem.
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

// select.cpp: which blocks are meant; false when there is nothing to go on with
bool select(Elaboration& elaboration);
/// The models of a scene as one, in which fields of one model stand for coefficients of the same name in the others.
std::optional<ast::Model> coupled_model(const ast::File& file, const ast::Scene& scene);

// declarations.cpp: the names of the model; with the grid its fields and coefficients, of a vector the components
void declare_model(Elaboration& elaboration);
void bind_fields(Elaboration& elaboration);
// placements.cpp: where fields have their values, and whether expressions are taken where they can be
/// Of the component `component` of a vector, or of a number (-1); centres where nothing is written or after a
/// diagnostic.
Placement placement_of(Elaboration& elaboration, const std::optional<ast::Identifier>& on, int component);
/// The same for a scene of `axes` axes, without diagnostics.
std::optional<Placement> placement_named(const std::string& on, int component, int axes);
void check_placements(Elaboration& elaboration);
/// `where` is where the mistake is shown that has no place in the text.
void report_misplaced(Elaboration& elaboration, const Placements::Mistake& mistake, SourceRange where);
// program.cpp: the same for a hand-written program, and what its fills say of the boundaries
void declare_program(Elaboration& elaboration);
void bind_fills(Elaboration& elaboration);
/// Steps of the loop around the program of the scene; nullptr when there is none.
const ast::Loop* find_loop(const Elaboration& elaboration);

// task.cpp: which parameters are unknown; later everything else
void mark_unknowns(Elaboration& elaboration);
void bind_task(Elaboration& elaboration);
// state_maps.cpp: the lines of the task; beside a scene of other states with what its map makes in the place of these
std::vector<ast::Item> items_of_task(Elaboration& elaboration);
// optimiser.cpp
std::optional<Optimiser> optimiser_of(Elaboration& elaboration, const ast::UsingItem& item);

// data_times.cpp
void check_data_times(Elaboration& elaboration);
// radiating.cpp: whether sides by which waves leave are ones. Of a state, or of what is solved for
void check_radiating(Elaboration& elaboration, const State& state);
void check_radiating(Elaboration& elaboration);
// wall_formulas.cpp: whether values at walls that are made of fields can be had
void check_wall_formulas(Elaboration& elaboration);
// pole_places.cpp: whether nothing is divided by the length of 0 on a pole
void check_pole_places(Elaboration& elaboration);
void check_network_places(Elaboration& elaboration);
/// Whether it lies on faces of which some are poles.
bool is_on_pole(const Problem& problem, const Expr& e);
// boundary_values.cpp: whether they are finite
void check_boundary_values(Elaboration& elaboration);
// seams.cpp: warns where a coordinate is read over the seam of a periodic axis
void check_seams(Elaboration& elaboration);
// wall_derivatives.cpp
void check_wall_derivatives(Elaboration& elaboration);

// training.cpp: tasks that learn from trajectories
/// Of a task that is bound.
void check_written_files(Elaboration& elaboration);
bool learns_from_trajectories(const Elaboration& elaboration);
bool is_training_option(const std::string& name);
/// One datum a component; nullopt where the item is something else, none after a diagnostic.
std::optional<std::vector<Datum>> data_of_trajectories(Elaboration& elaboration, const ast::DataItem& item);
void bind_test_on(Elaboration& elaboration, const ast::TestItem& item, Test& test);
// test_fields.cpp: what a spectrum or a correlation is of. False after a diagnostic.
bool bind_fields(Elaboration& elaboration, const ast::TestItem& item, Test& test);
void bind_training(Elaboration& elaboration);

// scheme.cpp
void bind_scheme(Elaboration& elaboration);
/// Puts the row `key = value` into `scheme`; otherwise what could stand there instead.
struct SchemeRefusal {
  bool unknown_key = false;
  std::vector<std::string> choices;
};
std::optional<SchemeRefusal> set_scheme_key(Scheme& scheme, const std::string& key, const ast::Expr& value);
const std::vector<std::string>& scheme_keys();
/// What rows say of single fields; after these.
void bind_transports(Elaboration& elaboration);

// split.cpp
constexpr const char* split_key = "split";
/// The parts of a step; after the fields.
void bind_split(Elaboration& elaboration);
/// Whether the parts are all there is; after the equations.
void check_split(Elaboration& elaboration);

// waves.cpp
/// Whether a scheme made of waves fits the axes and the equations.
void check_waves(Elaboration& elaboration);
/// Why no waves go on for ever along the axes of the scene; "" where they do.
std::string obstacle_to_waves(const std::vector<Axis>& axes);

// implicit_schemes.cpp
/// Whether an implicit time scheme fits the equations.
void check_implicit(Elaboration& elaboration);

// settings.cpp
/// The number set for `key`; nullopt when none is or after a diagnostic.
std::optional<double> number_setting(Elaboration& elaboration, const std::string& key);
/// Scheme keys among the settings.
void apply_scheme_settings(Elaboration& elaboration);
/// Reports settings nobody asked for.
void check_settings(Elaboration& elaboration);

// parameters.cpp: values of parameters in the order of the scene, settings first
void bind_parameters(Elaboration& elaboration);

// grid.cpp
void bind_grid(Elaboration& elaboration);

// units.cpp: whether formulas fit the units that are told; after all else
void check_units(Elaboration& elaboration);

// scene_names.cpp
void declare_scene_lets(Elaboration& elaboration);
/// Those that nobody reads may hold mistakes all the same; after all that may read them.
void check_scene_lets(Elaboration& elaboration);

// gridless.cpp
/// Whether nothing varies in space where the scene has no grid.
void check_gridless(Elaboration& elaboration);
/// `what` stands in a scene that has none.
void report_no_grid(Elaboration& elaboration, const std::string& what, SourceRange range);

// networks.cpp
void bind_networks(Elaboration& elaboration);
/// network_symmetries.cpp: what its block says in `symmetric` is done to the network that `declared` has.
void bind_symmetries(Elaboration& elaboration, DeclaredNetwork& declared);
/// nullptr where the file has none of this name; who calls it adds the name to elaboration.networks.called.
const DeclaredNetwork* find_network(const Elaboration& elaboration, const std::string& name);
/// Those that were called become the problem's.
void keep_called_networks(Elaboration& elaboration);

// stretch.cpp
/// The formula of a stretched axis, with its numbers; after all axes.
void bind_stretch(Elaboration& elaboration, const ast::Expr& formula, int axis);

/// Formulas with the values of their parameters, which are fixed by it: a grid is made once.
Expr with_values(Elaboration& elaboration, const Expr& e);

// metric.cpp: coordinates that are no lengths. What their axes are called; after the axes, what lengths are
void bind_axis_names(Elaboration& elaboration);
void bind_metric(Elaboration& elaboration);
/// Slopes that conditions at sides give are those of lengths: made those of coordinates. Of what is called `name`.
void measure_sides(const Elaboration& elaboration, const std::string& name, std::vector<AxisSides>& boundary);
/// Whether fields have what they need at poles; after the boundaries.
void check_poles(Elaboration& elaboration);
/// True, with a diagnostic, where coordinates are no lengths.
bool is_refused_in_curves(Elaboration& elaboration, const std::string& what, SourceRange range);

// time.cpp
void bind_time(Elaboration& elaboration);
/// The Courant number, and what moves how fast; after the equations.
void bind_courant(Elaboration& elaboration);
/// Behind it, subcycles and transports.
void bind_step_control(Elaboration& elaboration);
/// steady.cpp: until steady; after the task.
void check_steady(Elaboration& elaboration);
/// Equations that make several steps within each.
void bind_subcycles(Elaboration& elaboration);
/// Times of `at t = ...`, each the end of a step of this run, when `on_steps`.
When when_of(Elaboration& elaboration, const ast::When& when, bool on_steps);

/// How many steps make `length`, when that is a whole number.
std::optional<double> whole_steps(double length, double step);

// outputs.cpp
void bind_outputs(Elaboration& elaboration);
/// What the selection asks for beside them.
void bind_shown(Elaboration& elaboration);
/// Steps that make the interval `every` of `what`; nullopt after a diagnostic.
std::optional<int> interval_of(Elaboration& elaboration, const ast::Expr& every, const char* what);

// controls.cpp
void bind_controls(Elaboration& elaboration);
/// The values of a window, which is longer or shorter than the scene.
void bind_controls_of_windows(Elaboration& elaboration);
// masks.cpp: behind the controls, which may move them
void bind_masks(Elaboration& elaboration);

// events.cpp
void bind_events(Elaboration& elaboration);

// equations.cpp: lets and equations
void bind_equations(Elaboration& elaboration);

/// Notes that the states were given `what` at `name`; false, with a diagnostic, when one of them was given it before.
bool is_first(Elaboration& elaboration, const std::string& what, const ast::Identifier& name,
              const std::vector<State*>& states, std::map<std::string, SourceRange>& seen);

// wall_weights.cpp: the last part, as it needs what unknowns begin with
void check_wall_weights(Elaboration& elaboration);

// open_places.cpp: likewise
void check_open_places(Elaboration& elaboration);

// points.cpp
/// The place so many cells behind the low end of an axis, and before the high one.
Expr place_after(const Axis& axis, int number_of_axis, double cells);
Expr place_before(const Axis& axis, int number_of_axis, double cells);

// boundaries.cpp
void bind_boundaries(Elaboration& elaboration);
/// What the scene says of the state at x.low, ...
std::optional<SourceRange> boundary_of_side(const Elaboration& elaboration, const std::string& state,
                                            const std::string& place);
// projections.cpp: constraints
void bind_projections(Elaboration& elaboration);
void check_projected_starts(Elaboration& elaboration);
/// Of a field that the model solves for, which is no state.
std::vector<AxisSides> boundary_of_solved(Elaboration& elaboration, const std::string& name);
/// The sides that a boundary line or fill names. `values` has one AxisSides an axis and `seen` the places given before.
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
/// A number of each state that `when` names: a loss, a test, an observable.
std::optional<Expr> quantity_of(Elaboration& elaboration, const ast::Expr& e, const std::string& what,
                                const When& when = {});
/// The same of what was read already; `whole` is where it stands.
std::optional<Expr> quantity_of(Elaboration& elaboration, const Expr& value, const std::string& what,
                                SourceRange whole);
/// The loss whose averages are in the elaboration.
void add_loss_of_averages(Elaboration& elaboration, const Expr& value, const When& when, SourceRange range);
/// Whether an observable or test may have this name; `seen` are those before it.
bool can_name_a_quantity(Elaboration& elaboration, const ast::Identifier& name,
                         std::map<std::string, SourceRange>& seen);

// histories.cpp: what time schemes that remember need, and cannot do
void add_histories(Elaboration& elaboration);
/// u_rate of u, or u_rate_2 where something of the file is called so.
std::string name_of_memory(const Elaboration& elaboration, const std::string& of, const std::string& suffix);
void check_histories(Elaboration& elaboration);
// guesses.cpp: what a model says that a solve for `name` begins with; nullopt where something was reported
std::optional<std::vector<Expr>> starts_of(Elaboration& elaboration, const std::vector<ast::Expr>& starts,
                                           const std::string& name);
/// Leaves those starts that the scheme asks for, else adds the last solutions: states, added by add_histories.
void add_guesses(Elaboration& elaboration, Solve& solved, const Origin& origin);
/// The same of a constraint, the name of whose solution is a state.
void add_guesses_of_constraint(Elaboration& elaboration, Solve& solved, const Origin& origin);
/// An error where there are some: of solves for what a step adds.
void refuse_starts(Elaboration& elaboration, const Solve& solved);
/// preconditioners.cpp: what the model says, where the scheme has iterations for it; false where that was reported.
bool add_preconditioner(Elaboration& elaboration, const std::optional<ast::Expr>& written, Solve& solved);
/// Without those that no step finds anew: what results alone solve for is not kept.
void drop_idle_guesses(Elaboration& elaboration);
void check_guess(Elaboration& elaboration);
/// What the scheme says of cycles and iterations that no solve makes.
void check_solve_keys(Elaboration& elaboration);

// usage.cpp: drops what nobody reads, and says so
void drop_unused(Elaboration& elaboration);

}  // namespace dpde::model
