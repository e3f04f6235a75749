// SPDX-License-Identifier: Apache-2.0
// Model level: one scene with its model, scheme and (maybe) task, resolved and typed. From this level on every name is
// resolved, every expression has a type, the numbers of the scene are evaluated, lap/grad/div are written out over the
// axes of the scene's grid, lets and user names are gone. Not yet decided: how a derivative is discretised.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "model/expr.h"
#include "model/scheme.h"
#include "model/training.h"
#include "network/network.h"
#include "source/source_file.h"
#include "support/vocabulary.h"

namespace dpde::model {

/// A stretched axis: `map` gives the position of a point as a formula of numbers and of the axis' coordinate, which
/// runs uniformly from low to high.
struct Stretch {
  Expr map;
  double low = 0, high = 1;
};
/// low, high and spacing() belong to the uniform coordinate; centre(i) and face(i) are positions. Both agree on an axis
/// that is neither stretched nor descending.
struct Axis {
  std::string name;  // x, y, z
  double low = 0, high = 1;
  int cells = 1;
  Topology topology = Topology::periodic;
  std::optional<Stretch> stretch = {};
  std::optional<double> ends = {};  // low + high, on a descending axis: position = low + high - coordinate
  double spacing() const { return (high - low) / cells; }
  double centre(std::int64_t i) const { return place(low + (static_cast<double>(i) + 0.5) * spacing()); }
  /// The lower face of cell i.
  double face(std::int64_t i) const { return place(low + static_cast<double>(i) * spacing()); }
  double width(std::int64_t i) const { return stretch ? face(i + 1) - face(i) : spacing(); }
  /// The position at uniform coordinate s. Beyond the ends the map is continued periodically, or as an odd function.
  double place(double s) const;
  bool runs_down() const { return ends.has_value(); }
  /// Whether a field on faces has values on the wall at the low (or high) end of the positions.
  bool holds_wall(bool is_low) const { return is_low == runs_down(); }
};
/// Wave k belongs to shell floor(|k|/unit + 1/2); the unit is the wavenumber of one wave along the longest axis with
/// several cells. A wave within rounding of a shell's edge belongs to the upper shell.
double wave_unit(const std::vector<Axis>& axes);
inline constexpr double shell_rounding = 1e-9;

/// Systems that pictures draw as they are: polar is (r, theta), maybe with z; cylinder is r, maybe with z; sphere is
/// (longitude, latitude) in radians. Of a given metric the lengths alone are known.
enum class CoordinateSystem : unsigned char { given, polar, cylinder, sphere };
/// Orthogonal curvilinear coordinates. scales[i], a formula of numbers and coordinates, is the length of a unit of axis
/// i. The volume of a cell is the product of all scales and spacings, times `around`, the length of the way around an
/// axis of symmetry.
struct Metric {
  std::string name;  // in messages: polar coordinates
  std::vector<Expr> scales;
  Expr around = 1.0;
  std::vector<std::string> axes = {};  // names of the first axes: r, theta
  CoordinateSystem system = CoordinateSystem::given;
};
/// "x.low". On a descending axis the low side is the one with the high coordinate.
std::string side_name(const Axis& axis, bool is_low);

struct Parameter {
  std::string name;
  double value = 0;
  bool unknown = false;   // an unknown of the task: stays symbolic; other parameters equal to 0 or 1 are folded
  bool is_fixed = false;  // the grid, times and the like were computed from its value
};

/// A formula, or the path of a file with the values.
struct Source {
  std::optional<Expr> formula;
  std::string file;            // .npy or .nc; path relative to the model file's folder
  std::string variable;        // of a .nc file; "": its only field
  std::optional<double> time;  // of a .nc file; nullopt: its last state
  Origin origin;
};

/// The value of a state inside a mask.
struct MaskedValue {
  Expr inside, value;  // inside is a condition
};

struct State {
  std::string name;
  std::string velocity_of;  // this state is dt of the named state, which has a second-order equation; "" otherwise
  std::string history_of;   // the named state (maybe a history itself), whose last step the time scheme stores here;
                            // or, for a guess, the solved unknown or the state that stores it. A history has no
                            // equation.
  bool is_guess = false;    // initial guess of solves; starts from 0 if nothing is known
  Placement placement{};
  std::vector<AxisSides> boundary;  // one per axis; `value` on axes along which the state is staggered
  std::optional<MaskedValue> held = {};
  int parts = 1;            // equal substeps per step, after the equations with fewer substeps
  std::optional<Expr> rhs;  // dt(name) = rhs; absent for histories and states of hand-written programs
  Source initial;
  std::optional<Origin> projected =
      {};                     // where the file asks for it: the initial state is projected onto its constraint
  std::optional<Expr> exact;  // of x, y, z, t, params
  Origin origin;              // of the equation
};

/// Whether a side of the state is radiating: waves leave there, and the slope follows from the time derivative.
bool radiates(const State& state);

/// Adaptive substeps: each step is divided such that the scheme's error estimate of a substep stays within `absolute` +
/// `relative` times the value in each cell (Hairer, Norsett, Wanner I, II.4).
struct StepControl {
  double relative = 0, absolute = 0;
  double first = 0;  // length of the first trial substep
};

/// Values of a coefficient on the walls across one axis.
struct WallValues {
  int axis = 0;
  double low = 0, high = 0;
};
/// Which sides are poles.
struct AtPoles {
  bool low = false, high = false;
};
struct Coefficient {
  std::string name;
  Source value;
  Placement placement{};
  std::optional<WallValues> walls = {};  // at other walls, and without it, the slope is zero
  std::array<AtPoles, 3> at_poles = {};  // one per axis
  bool turns_round = false;              // changes sign across a pole, as vector components do
  bool is_mask = false;                  // 1 where the scene's condition is true, else 0
  int every = 0;  // > 0: a control field, with separate values for each interval of that many steps. Its formula is
                  // evaluated in the middle of each interval.
  bool is_control() const { return every > 0; }
};

/// A parameter (`name`) with a separate value for each interval of `every` steps; the last interval may be shorter.
struct Control {
  std::string name;
  int every = 1;
  std::vector<double> values;               // one per interval: the formula in the middle of it
  std::vector<double> start;                // initial values if a task optimises it; else empty
  Expr formula = 0.0, start_formula = 0.0;  // of numbers, parameters and t
  Origin origin;
};

/// File with the weights of a network, instead of random weights from its seed.
struct GivenWeights {
  std::string network;
  Source from;  // a .safetensors or .npz file
};

/// A named number computed by reductions: a loss term, an observable, a test.
struct Quantity {
  std::string name;
  Expr value;  // linear in Reduce over all axes; the operands may contain more reductions
  Origin origin;
};

/// Which states of a run are used by a quantity or datum.
struct When {
  enum class Kind { end, at, over, steps } kind = Kind::end;
  std::vector<double> times;                 // of `at`
  int count = 0;                             // of `steps`: this many states after the first, or
  bool is_last = false;                      // the last of these only
  std::optional<Reduce::Kind> counted = {};  // mean, sum or integral over these states; nullopt: each reduction says it
};

struct Datum {
  std::string name;
  std::string file, variable;  // load("...", variable), or
  bool trajectories = false;   // of that file: states of runs; a training sample can begin with each of them
  bool begins_windows() const { return trajectories && variable.empty(); }  // and has no values itself
  std::string scene, field;  // the field or observable of another scene's run
  bool series = false;       // one number per state, uniform in space
  When when;
  Origin origin;
  Placement placement{};
};
struct Unknown {
  enum class Kind { parameter, initial, coefficient, control, network } kind = Kind::parameter;
  std::string name;  // of the parameter, of the state (its initial values are unknown), of the coefficient, of the
                     // control, or of the network (its weights are unknown)
  Source from;  // a field: formula or file (default: the scene's own values); parameter: a number; control: formula
  Origin origin;
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
  bool is_bounded() const { return low > -std::numeric_limits<double>::infinity(); }
  bool is_field() const { return kind == Kind::initial || kind == Kind::coefficient; }
};
/// The order of accuracy that the author declares for an operator, and the body for one of its calls: uniform arguments
/// are substituted, other arguments are fields with unique names.
struct StatedOrder {
  std::string name;
  int order = 0;              // 0: none declared
  std::vector<Expr> body;     // the components of the result
  bool in_equations = false;  // else used in losses, observables and the like
  Origin origin;              // of the name, in the operator's definition
};
/// A field that a run can write in addition to its states: one component of a name of the model, at its own placement.
struct OutputField {
  std::string name;
  Expr value;
  Placement placement{};
  Origin origin;
};
/// A run writes these states and `shown` every `every` steps, and always the first and the last state.
struct Output {
  std::vector<std::string> fields;
  int every = 0;  // 0: only the first and the last
  Origin origin;
};
/// Assignments at the end of steps. All updates of an event read the values before it; a later event reads the values
/// after an earlier one.
struct Event {
  struct Update {
    std::string state;
    Expr value;
  };
  bool after_step = false;  // after every step and every substep of the Courant control
  int every = 0;            // steps between two events; 0: after the steps in `at`
  std::vector<int> at;      // 1 is the first
  std::vector<Update> updates;
  Origin origin;
};
/// Actions after the stages of a step: fields are fixed inside masks, and a constraint is enforced. `multiplier` is a
/// state in the right-hand sides of the corrected states. `potential`, a solve, is its required value times the time
/// over which the stage integrated the right-hand sides. For an increment, `potential` is the change of the multiplier,
/// and the right-hand sides contain its value from the step before.
struct Projection {
  enum class Kind : unsigned char { each_stage, increment_each_stage, increment_each_step, between };
  std::string multiplier;  // "" and no potential: no constraint
  Expr constraint = 0.0;   // has to be 0
  std::optional<Expr> potential;
  Kind kind = Kind::each_stage;        // between: after all stages but the last, if other projections act once per step
  std::vector<Event::Update> updates;  // read the states at the end of the stage
  Origin origin;

  bool is_increment() const { return kind == Kind::increment_each_stage || is_each_step(); }
  bool is_each_step() const { return kind == Kind::increment_each_step; }
  bool follows(bool is_last_stage) const { return is_last_stage ? kind != Kind::between : !is_each_step(); }
};
struct Loss {
  Expr value;  // like Quantity::value
  When when;
  Origin origin;
  std::string average = {};  // not "": the mean over the states is not a loss but a number in losses of averages
  bool of_averages = false;  // a formula of such averages and of parameters, evaluated once per run
};
struct Test {
  /// statistic: of the quantity; its mean and standard deviation over time are compared with those of the data.
  /// spectrum: of the fields; the mean over time is compared with that of the data. correlation: between the fields and
  /// the data's.
  enum class Kind { number, statistic, spectrum, correlation };
  Quantity quantity;  // of fields: mean(f^2)/2, summed over them
  When when;          // steps: of the runs of `on`
  std::string on;     // a file of trajectories; "": the run of the scene itself
  Origin on_origin;
  Kind kind = Kind::number;
  std::vector<Expr> fields;  // spectrum and correlation: the components compared
  double threshold = 0;      // of a correlation
  bool has_fields() const { return !fields.empty(); }
  struct Baseline {
    std::string scene, on;
    Origin origin;
    std::map<std::string, std::string> method = {};  // in charts: scheme keys that replace the scene's
  };
  std::vector<Baseline> beside;  // scenes that run from the same data, for comparison
};
struct Optimiser {
  enum class Kind { gradient_descent, adam, lbfgs, newton_cg } kind = Kind::lbfgs;
  double rate = 0;                 // gradient_descent, adam
  double momentum = 0, decay = 0;  // momentum: gradient_descent; decay: both; for training
  bool gauss_newton = false;       // newton_cg: instead of the full Hessian
  int iterations = 50;
  Origin origin = {};  // the optimiser's line
};
struct Task {
  std::string name;
  bool certifies = false;  // made by `verify` for a scene without a task: all is unknown, data have no source
  std::vector<Datum> data;
  /// The trajectories with which training samples begin: the datum without values of its own, else the first one; null
  /// if there are none.
  const Datum* datum_of_windows() const;
  std::vector<Unknown> unknowns;
  std::vector<Loss> losses;
  std::optional<Optimiser> optimiser;
  std::vector<Test> tests;
  std::vector<Test>
      growths;  // growth of small perturbations along the runs of a file; their quantities have only names
  std::optional<Training>
      training;  // if the data are trajectories; then the scene's run is one training sample of problem.steps steps
};

/// Accuracy that a scene asks for: relative root-mean-square error at the end of the run.
struct Accuracy {
  double tolerance = 0;
  std::vector<std::string> states;  // empty: all
};

/// Whether and how the length of steps depends on the state.
struct Substeps {
  double courant = 0;        // > 0: each step is divided into the fewest equal substeps with substep*rate <= courant
  std::optional<Expr> rate;  // sum over the axes of speed over spacing; with courant
  std::optional<StepControl> control;
};

/// What reports, pictures, files and hosts say of a problem; no program is made of it.
struct Remarks {
  std::map<std::string, std::string> units;  // by names of fields, parameters, observables, axes and t, where known
  std::vector<std::pair<std::string, std::string>> put_in;  // (field, field whose formula contains the first's)
  std::vector<std::string> dropped;                         // dropped zero terms and unused items, in words
};

struct Problem {
  std::string scene;
  std::string model;    // name of the model, or
  std::string program;  // name of the hand-written program of the step
  std::vector<Axis> axes;
  bool has_grid = true;          // otherwise one cell, and nothing varies in space
  std::optional<Metric> metric;  // nullopt: coordinates are lengths
  std::vector<Parameter> params;
  std::vector<State> states;
  std::vector<Coefficient> coefficients;
  std::vector<Control> controls;
  std::vector<network::Network> networks;  // those that are called, built for the axes of the scene
  std::vector<GivenWeights> weights;
  std::vector<Quantity> observables;
  std::optional<Accuracy> accuracy;
  std::vector<OutputField> shown;
  std::vector<Output> outputs;
  std::vector<Projection> projections;
  std::vector<Event> events;           // in order of execution
  std::vector<StatedOrder> operators;  // one entry for each different use
  double t_begin = 0, step = 0;
  int steps = 0;
  Substeps substeps;
  double steady = 0;  // > 0: the run ends when no state changes faster than this per unit of time
  Origin time_origin;
  Scheme scheme;
  std::optional<Task> task;
  Remarks remarks;

  /// Whether steps have substeps whose number depends on the state.
  bool has_parts() const { return substeps.rate.has_value() || substeps.control.has_value(); }
  const State* find_state(const std::string& name) const;
  const OutputField* find_shown(const std::string& name) const;
  /// Whether a state or an output field lies on faces along the axis.
  bool has_faces(std::size_t axis) const;
  /// dt(name) as a state, or nullptr.
  const State* velocity_of(const std::string& name) const;
  /// The state that stores the last step of `name` for the time scheme, or nullptr.
  const State* history_of(const std::string& name) const;
  const Parameter* find_param(const std::string& name) const;
  const Coefficient* find_coefficient(const std::string& name) const;
  const Control* find_control(const std::string& name) const;
  const network::Network* find_network(const std::string& name) const;
  /// The constraint that determines the state, or nullptr.
  const Projection* find_projection(const std::string& state) const;
  /// Whether the state is corrected after each stage.
  bool is_projected(const std::string& state) const;
  /// The task's unknown for this coefficient, or nullptr.
  const Unknown* find_unknown(const Coefficient& coefficient) const;
  /// Number of intervals of `every` steps in the run; the last interval may be shorter.
  int intervals(int every) const { return steps > 0 ? (steps - 1) / every + 1 : 1; }
  /// "m/s"; "" if unknown.
  std::string unit_of(const std::string& name) const;
  /// The seeds of noise in formulas, ascending.
  std::vector<std::uint64_t> noises() const;
};

/// Name of the field with this noise.
std::string noise_name(std::uint64_t seed);

}  // namespace dpde::model
