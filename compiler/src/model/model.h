// SPDX-License-Identifier: Apache-2.0
// Model level: one scene with its model, scheme and (maybe) task, resolved and typed. True here and not before: every
// name means something, every expression has a type, numbers of the scene are evaluated, lap/grad/div are spelled out
// over the axes of the scene's grid, lets and user names are gone. Not yet true: how a derivative is discretised.
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

/// Where the points of a stretched axis lie: `map`, a formula of numbers and of the axis' coordinate, which runs
/// uniformly from low to high.
struct Stretch {
  Expr map;
  double low = 0, high = 1;
};
/// low, high and spacing() are those of the coordinate that runs uniformly, centre(i) and face(i) the places. They are
/// the same where nothing is stretched or runs down.
struct Axis {
  std::string name;  // x, y, z
  double low = 0, high = 1;
  int cells = 1;
  Topology topology = Topology::periodic;
  std::optional<Stretch> stretch = {};
  std::optional<double> ends = {};  // low + high, where places run down: each is that minus the coordinate
  double spacing() const { return (high - low) / cells; }
  double centre(std::int64_t i) const { return place(low + (static_cast<double>(i) + 0.5) * spacing()); }
  /// On the lower side of cell i.
  double face(std::int64_t i) const { return place(low + static_cast<double>(i) * spacing()); }
  double width(std::int64_t i) const { return stretch ? face(i + 1) - face(i) : spacing(); }
  /// Where the uniform coordinate is s; beyond the ends the map goes on periodically, or as its odd image.
  double place(double s) const;
  bool runs_down() const { return ends.has_value(); }
  /// Whether fields on faces hold the values on the wall where the place is low, or high.
  bool holds_wall(bool is_low) const { return is_low == runs_down(); }
};
/// Waves k lie in shell floor(|k|/unit + 1/2), where the unit is one wave along the longest axis with several cells.
/// What is nearer to the edge of a shell than rounding lies in the upper one.
double wave_unit(const std::vector<Axis>& axes);
inline constexpr double shell_rounding = 1e-9;

/// Orthogonal coordinates that are no lengths: a unit of axis i is scales[i] long, a formula of numbers and
/// coordinates; a cell is as large as their product times its spacings and `around`, the way around an axis of
/// symmetry.
struct Metric {
  std::string name;  // as messages have it: polar coordinates
  std::vector<Expr> scales;
  Expr around = 1.0;
  std::vector<std::string> axes = {};  // what the first ones are called: r, theta
};
/// "x.low": of the side where the coordinate is high where the axis runs down.
std::string side_name(const Axis& axis, bool is_low);

struct Parameter {
  std::string name;
  double value = 0;
  bool unknown = false;   // an unknown of the task: stays symbolic, others equal to 0 or 1 are folded
  bool is_fixed = false;  // the grid, times and the like are made of its value
};

/// A formula, or the path of a file that holds the values.
struct Source {
  std::optional<Expr> formula;
  std::string file;            // .npy or .nc, relative to the model file's folder
  std::string variable;        // of a .nc file; "": the only field it holds
  std::optional<double> time;  // of a .nc file; none: its last state
  Origin origin;
};

/// A value that a state has inside a mask.
struct MaskedValue {
  Expr inside, value;  // a condition
};

struct State {
  std::string name;
  std::string velocity_of;  // this state is dt of that one, whose equation is of second order; "" otherwise
  std::string history_of;   // what a time scheme keeps of that one's last step (that one may be a history itself), or,
                            // a guess, what was solved for, or the state that keeps that; has no equation
  bool is_guess = false;    // solves begin with it: 0 will do where nothing is known
  Placement placement{};
  std::vector<AxisSides> boundary;  // one an axis; along which the state is staggered: values
  std::optional<MaskedValue> held = {};
  int parts = 1;            // its equation makes so many equal steps within each, after those that make fewer
  std::optional<Expr> rhs;  // of dt(name) = rhs; absent for histories and the states of a hand-written program
  Source initial;
  std::optional<Origin> projected =
      {};                     // its initial state is taken to where its constraint is true: where that is said
  std::optional<Expr> exact;  // of x, y, z, t, params
  Origin origin;              // of the equation
};

/// Whether waves of the state leave by a side, whose slope then follows from the rate.
bool radiates(const State& state);

/// Each step is made in parts, as long as the error that the scheme estimates for each of them allows: in each cell
/// `absolute` + `relative` times the value is tolerated (Hairer, Norsett, Wanner I, II.4).
struct StepControl {
  double relative = 0, absolute = 0;
  double first = 0;  // length of the first part that is tried
};

/// What a coefficient is on the walls across one axis.
struct WallValues {
  int axis = 0;
  double low = 0, high = 0;
};
/// Whether sides are poles.
struct AtPoles {
  bool low = false, high = false;
};
struct Coefficient {
  std::string name;
  Source value;
  Placement placement{};
  std::optional<WallValues> walls = {};  // elsewhere, and without them, it has no slope at walls
  std::array<AtPoles, 3> at_poles = {};  // along each axis
  bool turns_round = false;              // on the way over a pole it changes its sign, as components of vectors do
  bool is_mask = false;                  // 1 where the scene's condition is true, else 0
  int every = 0;  // > 0: a control field, with values of its own for each interval of so many steps: its formula in the
                  // middle of each
  bool is_control() const { return every > 0; }
};

/// A parameter (`name`) with a value of its own for each interval of `every` steps, the last one maybe shorter.
struct Control {
  std::string name;
  int every = 1;
  std::vector<double> values;               // one an interval: the formula in its middle
  std::vector<double> start;                // where a task begins that seeks it; else empty
  Expr formula = 0.0, start_formula = 0.0;  // of numbers, parameters and t
  Origin origin;
};

/// Where the weights of a network come from, in place of its seed.
struct GivenWeights {
  std::string network;
  Source from;  // a .safetensors or .npz file
};

/// A named number made of reductions: a loss term, an observable, a test.
struct Quantity {
  std::string name;
  Expr value;  // linear in Reduce over all axes; what these hold may have more of them
  Origin origin;
};

/// Which states of a run a quantity or datum looks at.
struct When {
  enum class Kind { end, at, over, steps } kind = Kind::end;
  std::vector<double> times;                 // of `at`
  int count = 0;                             // of `steps`: each of so many states behind the first one, or
  bool is_last = false;                      // the last of these alone
  std::optional<Reduce::Kind> counted = {};  // mean, sum or integral over these states; none: as each reduction says
};

struct Datum {
  std::string name;
  std::string file, variable;  // load("...", variable), or
  bool trajectories = false;   // of that file: states of runs, each of which a window may begin with
  bool begins_windows() const { return trajectories && variable.empty(); }  // and has no values itself
  std::string scene, field;  // the field of another scene's run, or its observable
  bool series = false;       // one number a state of the run, the same at all points
  When when;
  Origin origin;
  Placement placement{};
};
struct Unknown {
  enum class Kind { parameter, initial, coefficient, control, network } kind = Kind::parameter;
  std::string name;  // of the parameter, the state whose initial values are sought, the coefficient, the control or the
                     // network whose weights are learned
  Source from;  // a field: formula or file (default: the scene's own values); parameter: a number; control: formula
  Origin origin;
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
  bool is_bounded() const { return low > -std::numeric_limits<double>::infinity(); }
  bool is_field() const { return kind == Kind::initial || kind == Kind::coefficient; }
};
/// The order that an author states of an operator, and the body as one of its uses has it: arguments that are the same
/// at all points put in, the others as fields of names that nothing else has.
struct StatedOrder {
  std::string name;
  int order = 0;              // 0 states nothing
  std::vector<Expr> body;     // the components of what it gives
  bool in_equations = false;  // else in losses, observables and the like
  Origin origin;              // of the name, where the operator is defined
};
/// What a run can write down beside its states: a component of a name of the model, where it lies.
struct OutputField {
  std::string name;
  Expr value;
  Placement placement{};
  Origin origin;
};
/// What a run writes down: these states and `shown` every so many steps, the first and the last time in any case.
struct Output {
  std::vector<std::string> fields;
  int every = 0;  // 0: only the first and the last
  Origin origin;
};
/// Values that change at the end of steps. All updates see the values before the event; a later event those behind it.
struct Event {
  struct Update {
    std::string state;
    Expr value;
  };
  bool after_step = false;  // of each step, and of each part of one that a Courant number splits
  int every = 0;            // steps from one to the next; 0: behind the steps of `at`
  std::vector<int> at;      // 1 is the first
  std::vector<Update> updates;
  Origin origin;
};
/// What is done behind stages of a step: fields are held inside masks, and a constraint is made true. `potential`,
/// a solve, is what `multiplier` has to be, a state that stands in the rates of those that are changed, times the time
/// over which that stage took the rates; of increments what it changes by, and the rates have that of the step before.
struct Projection {
  enum class Kind : unsigned char { each_stage, increment_each_stage, increment_each_step, between };
  std::string multiplier;  // "", and no potential: there is no constraint
  Expr constraint = 0.0;   // what has to be 0
  std::optional<Expr> potential;
  Kind kind = Kind::each_stage;        // between: behind all stages but the last, where others come once a step
  std::vector<Event::Update> updates;  // from the states as the stage leaves them
  Origin origin;

  bool is_increment() const { return kind == Kind::increment_each_stage || is_each_step(); }
  bool is_each_step() const { return kind == Kind::increment_each_step; }
  bool follows(bool is_last_stage) const { return is_last_stage ? kind != Kind::between : !is_each_step(); }
};
struct Loss {
  Expr value;  // as of a Quantity
  When when;
  Origin origin;
  std::string average = {};  // not "": its mean over the states is no loss, but this number in losses of averages
  bool of_averages = false;  // a formula of such numbers and of parameters, once a run
};
struct Test {
  /// statistic: the quantity of the states themselves; its mean and deviation over time are compared with those of the
  /// data. spectrum: of the fields, the mean over time is compared with that of the data. correlation: of the fields
  /// with the data's.
  enum class Kind { number, statistic, spectrum, correlation };
  Quantity quantity;  // of fields: mean(f^2)/2, summed over them
  When when;          // steps: of the runs of `on`
  std::string on;     // a file of trajectories; "": the scene's own run
  Origin on_origin;
  Kind kind = Kind::number;
  std::vector<Expr> fields;  // of spectrum and correlation: the components of what it is of
  double threshold = 0;      // of a correlation
  bool has_fields() const { return !fields.empty(); }
  struct Baseline {
    std::string scene, on;
    Origin origin;
    std::map<std::string, std::string> method = {};  // of charts: keys of a scheme in the place of the scene's
  };
  std::vector<Baseline> beside;  // scenes that are run from the same data
};
struct Optimiser {
  enum class Kind { gradient_descent, adam, lbfgs, newton_cg } kind = Kind::lbfgs;
  double rate = 0;                 // gradient_descent, adam
  double momentum = 0, decay = 0;  // of gradient_descent, of both: for training
  bool gauss_newton = false;       // newton_cg: in place of the full Hessian
  int iterations = 50;
  Origin origin = {};  // of its line
};
struct Task {
  std::string name;
  bool certifies = false;  // made by verify for a scene without a task: all that can be is unknown, data have no source
  std::vector<Datum> data;
  /// Of trajectories, whose file windows begin with: the one that has no values itself, or else the first; null where
  /// there are none.
  const Datum* datum_of_windows() const;
  std::vector<Unknown> unknowns;
  std::vector<Loss> losses;
  std::optional<Optimiser> optimiser;
  std::vector<Test> tests;
  std::vector<Test>
      growths;  // of small perturbations along the runs of a file: their quantities have nothing but names
  std::optional<Training>
      training;  // of a task whose data are trajectories; the scene's run is then a window, problem.steps its length
};

/// What a scene wants of its result: relative error at the end of the run, root mean square.
struct Accuracy {
  double tolerance = 0;
  std::vector<std::string> states;  // none: all
};

struct Problem {
  std::string scene;
  std::string model;    // name of the model, or
  std::string program;  // name of the hand-written program that is the step
  std::vector<Axis> axes;
  bool has_grid = true;          // else there is one cell, and nothing varies in space
  std::optional<Metric> metric;  // none: coordinates are lengths
  std::vector<Parameter> params;
  std::vector<State> states;
  std::vector<Coefficient> coefficients;
  std::vector<Control> controls;
  std::vector<network::Network> networks;  // those that are called, for the axes of the scene
  std::vector<GivenWeights> weights;
  std::vector<Quantity> observables;
  std::optional<Accuracy> accuracy;
  std::vector<OutputField> shown;
  std::vector<Output> outputs;
  std::vector<Projection> projections;
  std::vector<Event> events;           // in the order in which they happen
  std::vector<StatedOrder> operators;  // each as often as it is used in different ways
  double t_begin = 0, step = 0;
  int steps = 0;
  double courant = 0;        // > 0: each step is done in as many equal parts as keep step*rate below it
  std::optional<Expr> rate;  // speed over spacing, added up over the axes; with courant
  std::optional<StepControl> step_control;
  double steady = 0;  // > 0: the run ends where no state changes by more than that a unit of time
  Origin time_origin;
  Scheme scheme;
  std::optional<Task> task;
  std::map<std::string, std::string> units;  // of fields, parameters, observables, axes and t by names, where known
  std::vector<std::pair<std::string, std::string>> put_in;  // fields and those whose formulas theirs are part of
  std::vector<std::string> dropped;  // what a zero coefficient or nobody's need removed, in words, for `check`

  /// Whether steps are made in parts, which depend on the state.
  bool has_parts() const { return rate.has_value() || step_control.has_value(); }
  const State* find_state(const std::string& name) const;
  const OutputField* find_shown(const std::string& name) const;
  /// Whether a state, or what is shown, lies on faces along the axis.
  bool has_faces(std::size_t axis) const;
  /// dt(name) as a state, or nullptr.
  const State* velocity_of(const std::string& name) const;
  /// What the time scheme keeps of the last step of `name`, or nullptr.
  const State* history_of(const std::string& name) const;
  const Parameter* find_param(const std::string& name) const;
  const Coefficient* find_coefficient(const std::string& name) const;
  const Control* find_control(const std::string& name) const;
  const network::Network* find_network(const std::string& name) const;
  /// The constraint that gives the state, or nullptr.
  const Projection* find_projection(const std::string& state) const;
  /// Whether something is done to the state behind each stage.
  bool is_projected(const std::string& state) const;
  /// The unknown of the task that the coefficient is, or nullptr.
  const Unknown* find_unknown(const Coefficient& coefficient) const;
  /// Into how many intervals of `every` steps the run is divided, the last one maybe shorter.
  int intervals(int every) const { return steps > 0 ? (steps - 1) / every + 1 : 1; }
  /// "m/s"; "" where nothing is known.
  std::string unit_of(const std::string& name) const;
  /// The seeds of noise in formulas, increasing.
  std::vector<std::uint64_t> noises() const;
};

/// What the field of a noise is called.
std::string noise_name(std::uint64_t seed);

}  // namespace dpde::model
