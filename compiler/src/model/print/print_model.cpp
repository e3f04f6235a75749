// SPDX-License-Identifier: Apache-2.0
#include "model/print/print_model.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <vector>

#include "model/analyse/placement.h"
#include "model/analyse/solves.h"
#include "model/build.h"
#include "model/uses.h"
#include "network/print_network.h"
#include "support/assert.h"
#include "support/match.h"

namespace dpde::model {

namespace {

constexpr int atom = 8;
constexpr double pi = 3.141592653589793;
constexpr const char* axis_names[] = {"x", "y", "z"};

/// A text and the precedence of its outermost operator.
struct Piece {
  std::string text;
  int precedence = atom;
};

Piece piece(const Expr& e);

std::string wrapped(const Expr& e, int least) {
  const Piece inner = piece(e);
  return inner.precedence < least ? "(" + inner.text + ")" : inner.text;
}

std::string bare(const Expr& e) { return piece(e).text; }

std::string list(const std::vector<Expr>& items) {
  std::vector<std::string> texts;
  for (const Expr& item : items) texts.push_back(bare(item));
  return fmt::format("{}", fmt::join(texts, ", "));
}

Piece number_piece(double value) {
  if (value == pi) return {"pi"};
  return {fmt::format("{}", value), value < 0 ? unary_precedence : atom};
}

/// a - (b - c), (a^b)^c and -a^2 keep their parentheses. No spaces around * and /, spaces around + - and comparisons.
Piece binary_piece(const Binary& b) {
  const int own = precedence(b.op);
  const bool is_power = b.op == BinaryOp::power;
  const bool compares = own == precedence(BinaryOp::less);
  const std::string left = wrapped(b.left, is_power || compares ? own + 1 : own);
  const std::string right = wrapped(b.right, is_power ? own : own + 1);
  const char* space = own >= precedence(BinaryOp::multiply) ? "" : " ";
  return {fmt::format("{}{}{}{}{}", left, space, spelling(b.op), space, right), own};
}

Piece derivative_piece(const Derivative& d) {
  if (d.order == 1) return {fmt::format("d{}({})", axis_names[d.axis], bare(d.operand))};
  return {fmt::format("d({}, {}, {})", bare(d.operand), axis_names[d.axis], d.order)};
}

Piece advect_piece(const Advect& a) {
  const std::string velocity = a.velocity.size() == 1 ? bare(a.velocity.front()) : "(" + list(a.velocity) + ")";
  return {fmt::format("advect({}, {})", velocity, bare(a.operand))};
}

/// u[+1, 0], (u*v)[0, -1]
Piece shift_piece(const Shift& s) {
  std::vector<std::string> offsets;
  for (const int cells : s.offset) offsets.push_back(cells > 0 ? fmt::format("+{}", cells) : fmt::format("{}", cells));
  return {fmt::format("{}[{}]", wrapped(s.operand, atom), fmt::join(offsets, ", "))};
}

Piece sample_piece(const Sample& s) {
  const std::string place = s.place.size() == 1 ? bare(s.place.front()) : "(" + list(s.place) + ")";
  const std::string what =
      interp_name(s.along).substr(std::string_view("interp").size());  // sample_lx: the point below along x
  return {fmt::format("sample{}({}, at = {})", what, s.field, place)};
}

const char* word_for(Reduce::Kind kind) {
  switch (kind) {
    case Reduce::Kind::mean: return "mean";
    case Reduce::Kind::sum: return "sum";
    case Reduce::Kind::integral: return "integral";
    case Reduce::Kind::max: return "max";
    case Reduce::Kind::min: return "min";
  }
  unreachable("reduction");
}

Piece reduce_piece(const Reduce& r) {
  std::vector<std::string> axes;
  for (std::size_t axis = 0; axis < r.over.size(); ++axis) {
    if (r.over[axis] && !r.is_over_all()) axes.emplace_back(axis_names[axis]);
  }
  const std::string list = axes.size() == 1 ? axes.front() : fmt::format("({})", fmt::join(axes, ", "));
  return {fmt::format("{}({}{})", word_for(r.reduction), bare(r.operand), axes.empty() ? "" : ", over = " + list)};
}

Piece piece(const Expr& e) {
  return match(
      e->kind, [](const Number& n) { return number_piece(n.value); }, [](const Param& p) { return Piece{p.name}; },
      [](const Field& f) { return Piece{f.name}; }, [](const Coordinate& c) { return Piece{axis_names[c.axis]}; },
      [](const Noise& n) { return Piece{fmt::format("noise({})", n.seed)}; },
      [](const Neg& n) {
        return Piece{"-" + wrapped(n.operand, unary_precedence), unary_precedence};
      },
      [](const Binary& b) { return binary_piece(b); },
      [](const Call& c) { return Piece{fmt::format("{}({})", name_of(c.fn), list(c.arguments))}; },
      [](const Select& s) { return Piece{fmt::format("if({}, {}, {})", bare(s.condition), bare(s.yes), bare(s.no))}; },
      [](const Derivative& d) { return derivative_piece(d); }, [](const Advect& a) { return advect_piece(a); },
      [](const Shift& s) { return shift_piece(s); },
      [](const Interpolate& i) { return Piece{fmt::format("interpolate({})", bare(i.operand))}; },
      [](const BandPass& b) { return Piece{fmt::format("band_pass({}, {}, {})", bare(b.operand), b.first, b.last)}; },
      [](const Sample& s) { return sample_piece(s); }, [](const Reduce& r) { return reduce_piece(r); },
      [](const Apply& a) {
        const std::string component = a.function.body.size() == 1 ? "" : std::string(".") + "xyz"[a.component];
        return Piece{fmt::format("{}({}){}", a.function.name, list(a.arguments), component)};
      },
      [](const NetworkCall& i) {
        return Piece{fmt::format("{}({}){}{}", i.network, list(i.arguments), i.name.empty() ? "" : ".", i.name)};
      },
      [](const Solve& s) { return Piece{s.name}; });
}

std::string load_text(const std::string& file, const std::string& variable) {
  return fmt::format("load(\"{}\"{})", file, variable.empty() ? "" : ", " + variable);
}

std::string text_of(const Side& side) {
  const SideCondition& condition = condition_of(side.kind);
  if (condition.word.empty()) return " = " + print(side.value);
  std::vector<std::string> given;
  for (const Expr* part : given_parts(side)) given.push_back(bare(*part));
  return (given.empty() ? " " : " = ") + condition.text(given);
}

std::string text_of(const When& when) {
  const std::string over = when.counted ? fmt::format(", {} over ", word_for(*when.counted)) : " over ";
  switch (when.kind) {
    case When::Kind::end: return "";
    case When::Kind::at: return fmt::format(" at t = {}", fmt::join(when.times, ", "));
    case When::Kind::over: return over + "time";
    case When::Kind::steps: return fmt::format("{}{} steps", when.is_last ? " after " : over, when.count);
  }
  unreachable("when");
}

std::string text_of(const Axis& axis) {
  const std::string stretched = axis.stretch ? ", stretched " + print(axis.stretch->map) : "";
  const std::string place = axis.ends ? fmt::format("  # the place is {} - {}", bare(*axis.ends), axis.name) : "";
  return fmt::format("grid {} = {} .. {}, cells {}{}{}{}", axis.name, bare(axis.low), bare(axis.high), axis.cells,
                     axis.topology == Topology::periodic ? ", periodic" : "", stretched, place);
}

/// "" if all axes are periodic.
std::string boundary_text(const Problem& problem, const State& state) {
  std::vector<std::string> sides;
  for (std::size_t i = 0; i < problem.axes.size() && i < state.boundary.size(); ++i) {
    if (problem.axes[i].topology == Topology::periodic) continue;
    sides.push_back(problem.axes[i].name + ".low" + text_of(state.boundary[i].low));
    sides.push_back(problem.axes[i].name + ".high" + text_of(state.boundary[i].high));
  }
  return sides.empty() ? "" : fmt::format("boundary {}: {}", state.name, fmt::join(sides, ", "));
}

std::string event_text(const Problem& p, const Event& event) {
  std::vector<double> times;
  for (const int step : event.at) times.push_back(p.t_begin + step * p.step);
  std::string text = event.after_step  ? "after step"
                     : event.every > 0 ? fmt::format("every {}", event.every * p.step)
                                       : fmt::format("at t = {}", fmt::join(times, ", "));
  for (const Event::Update& update : event.updates) {
    text +=
        fmt::format("{}{} = {}", &update == &event.updates.front() ? ": " : ", ", update.state, print(update.value));
  }
  return text;
}

/// In the solve the residual has the name of the unknown.
std::string preconditioner_text(const Solve& solve) {
  if (!solve.preconditioner) return "";
  NetworkCall call = std::get<NetworkCall>((*solve.preconditioner)->kind);
  call.arguments.front() = field("residual");
  return " preconditioner " + print(network_call(std::move(call)));
}

void add_solves(const Problem& p, std::vector<std::string>& lines) {
  for (const Solve* solve : solves_of(p)) {
    State unknown;
    unknown.name = solve->name;
    unknown.boundary = solve->boundary;
    const std::string boundary = boundary_text(p, unknown);
    std::vector<std::string> begun = solve->guesses;
    for (const Expr& start : solve->starts) begun.push_back(print(start));
    const std::string guess = begun.empty() ? "" : fmt::format(" from {}", fmt::join(begun, ", "));
    const std::string after = solve->iterations ? fmt::format(" after {} iterations", *solve->iterations) : "";
    lines.push_back(fmt::format("solve {} = {} for {}{}{}{}", print(solve->operation), print(solve->right), solve->name,
                                guess, preconditioner_text(*solve), after));
    if (!boundary.empty()) lines.push_back(boundary);
  }
}

/// How steps are divided into substeps.
void add_parts(const Problem& p, std::vector<std::string>& lines) {
  if (p.substeps.rate)
    lines.push_back(fmt::format("# parts of a step: courant {}, rate {}", p.substeps.courant, print(*p.substeps.rate)));
  if (p.substeps.control) {
    const StepControl& control = *p.substeps.control;
    lines.push_back(fmt::format("# parts of a step: tolerance {}, absolute {}, first {}", control.relative,
                                control.absolute, control.first));
  }
  for (const State& state : p.states) {
    if (state.parts > 1) lines.push_back(fmt::format("subcycle {} in {}", state.name, state.parts));
  }
  if (p.steady > 0) lines.push_back(fmt::format("# until steady {}", p.steady));
}

void add_units(const Problem& p, std::vector<std::string>& lines) {
  std::vector<std::string> units;
  for (const auto& [name, unit] : p.remarks.units) units.push_back(fmt::format("{} in {}", name, unit));
  if (!units.empty()) lines.push_back(fmt::format("# units: {}", fmt::join(units, ", ")));
}

/// Reported and written results of a run.
void add_results(const Problem& p, std::vector<std::string>& lines) {
  for (const Quantity& q : p.observables) lines.push_back(fmt::format("observe {} = {}", q.name, print(q.value)));
  if (p.accuracy) {
    const std::string on = p.accuracy->states.empty() ? "" : fmt::format(" on {}", fmt::join(p.accuracy->states, ", "));
    lines.push_back(fmt::format("accuracy {}{}", p.accuracy->tolerance, on));
  }
  for (const OutputField& shown : p.shown) lines.push_back(fmt::format("let {} = {}", shown.name, print(shown.value)));
  for (const Output& output : p.outputs) lines.push_back(print(output, p.step));
}

const char* stages_before(Projection::Kind kind) {
  switch (kind) {
    case Projection::Kind::each_stage:
    case Projection::Kind::increment_each_stage: return "each stage";
    case Projection::Kind::increment_each_step: return "each step";
    case Projection::Kind::between: return "all stages but the last";
  }
  unreachable("kind of projection");
}

std::vector<std::string> scene_lines(const Problem& p) {
  std::vector<std::string> lines;
  for (const Axis& axis : p.axes) lines.push_back(text_of(axis));
  if (p.metric) lines.push_back("# " + p.metric->name);
  for (const Control& control : p.controls)
    lines.push_back(print(control, p.step) + (p.find_param(control.name)->unknown ? "  # unknown" : ""));
  for (const Parameter& param : p.params) {
    if (p.find_control(param.name) != nullptr) continue;
    lines.push_back(fmt::format("{} = {}{}", param.name, bare(param.value), param.unknown ? "  # unknown" : ""));
  }
  for (const Coefficient& c : p.coefficients) lines.push_back(print(c, p.step));
  for (const GivenWeights& given : p.weights)
    lines.push_back(fmt::format("{} = load(\"{}\")", given.network, given.from.file));
  add_solves(p, lines);
  for (const State& state : p.states) {
    const bool has_rate = state.rhs && p.find_projection(state.name) == nullptr;
    if (has_rate) lines.push_back(fmt::format("dt({}) = {}", state.name, print(*state.rhs)));
  }
  for (const Projection& projection : p.projections) {
    for (const Event::Update& update : projection.updates)
      lines.push_back(
          fmt::format("behind {}: {} = {}", stages_before(projection.kind), update.state, print(update.value)));
  }
  const int axes = static_cast<int>(p.axes.size());
  for (const State& state : p.states) {
    if (state.placement != Placement{})
      lines.push_back(fmt::format("# {} on {}", state.name, describe(state.placement, axes)));
  }
  for (const Coefficient& c : p.coefficients) {
    if (c.placement != Placement{}) lines.push_back(fmt::format("# {} on {}", c.name, describe(c.placement, axes)));
  }
  for (const Coefficient& c : p.coefficients) {
    if (!c.walls) continue;
    const std::string& axis = p.axes[static_cast<std::size_t>(c.walls->axis)].name;
    lines.push_back(fmt::format("# boundary {0}: {1}.low = {2}, {1}.high = {3}", c.name, axis, bare(c.walls->low),
                                bare(c.walls->high)));
  }
  for (const State& state : p.states) {
    const std::string boundary = boundary_text(p, state);
    if (!boundary.empty()) lines.push_back(boundary);
  }
  for (const State& state : p.states)
    lines.push_back(
        fmt::format("initial {} = {}{}", state.name, print(state.initial), state.projected ? " projected" : ""));
  for (const State& state : p.states) {
    if (state.exact) lines.push_back(fmt::format("exact {} = {}", state.name, print(*state.exact)));
  }
  add_results(p, lines);
  for (const Event& event : p.events) lines.push_back(event_text(p, event));
  lines.push_back(
      fmt::format("time {} .. {}, step {}  # {} steps", p.t_begin, p.t_begin + p.steps * p.step, p.step, p.steps));
  add_parts(p, lines);
  add_units(p, lines);
  for (const std::string& words : p.remarks.dropped) lines.push_back("# dropped: " + words);
  return lines;
}

std::string text_of(const Datum& datum) {
  if (datum.begins_windows()) return fmt::format("data {} = trajectories(\"{}\")", datum.name, datum.file);
  if (datum.trajectories)
    return fmt::format("data {} = trajectories(\"{}\", {})", datum.name, datum.file, datum.variable);
  const std::string value = datum.scene.empty() ? load_text(datum.file, datum.variable)
                                                : fmt::format("{} from scene {}", datum.field, datum.scene);
  return fmt::format("data {} = {}{}", datum.name, value, text_of(datum.when));
}

std::string option_text(const char* name, double value) {
  return value == 0 ? "" : fmt::format(", {} = {}", name, value);
}

/// Only settings that differ from their defaults.
std::string text_of(const Training& training) {
  std::string text = fmt::format(", batch {}, epochs {}, seed {}", training.batch, training.epochs, training.seed);
  if (training.trials > 1) text += fmt::format(", trials {}", training.trials);
  if (!training.unroll.empty()) text += fmt::format(", unroll ({})", fmt::join(training.unroll, ", "));
  if (training.cut > 0) text += fmt::format(", cut {}", training.cut);
  if (training.noise > 0) text += fmt::format(", noise {}", training.noise);
  if (training.clip > 0) text += fmt::format(", clip {}", training.clip);
  if (training.validate > 0) text += fmt::format(", validate {}", training.validate);
  if (training.patience > 0) text += fmt::format(", patience {}", training.patience);
  if (training.schedule.kind == RateSchedule::Kind::halve)
    text += fmt::format(", schedule halve({})", training.schedule.every);
  if (training.schedule.kind == RateSchedule::Kind::cosine) text += ", schedule cosine";
  return text;
}

std::string text_of(const Optimiser& optimiser, const std::optional<Training>& training) {
  const auto text = [&]() -> std::string {
    switch (optimiser.kind) {
      case Optimiser::Kind::gradient_descent:
        return fmt::format("gradient_descent(rate = {}{}{})", optimiser.rate,
                           option_text("momentum", optimiser.momentum), option_text("decay", optimiser.decay));
      case Optimiser::Kind::adam:
        return fmt::format("adam(rate = {}{})", optimiser.rate, option_text("decay", optimiser.decay));
      case Optimiser::Kind::lbfgs: return "lbfgs()";
      case Optimiser::Kind::newton_cg:
        return fmt::format("newton_cg(hessian = {})", optimiser.gauss_newton ? "gauss_newton" : "full");
    }
    unreachable("optimiser");
  };
  return fmt::format("using {}{}", text(),
                     training ? text_of(*training) : fmt::format(", iterations {}", optimiser.iterations));
}

std::string runs_text(const Test& test) {
  std::string text = fmt::format(" on trajectories(\"{}\") for {} steps", test.on, test.when.count);
  const char* separator = " beside ";
  for (const Test::Baseline& beside : test.beside) {
    text += fmt::format("{}{} on trajectories(\"{}\")", separator, beside.scene, beside.on);
    separator = ", ";
  }
  return text;
}

std::string text_of(const Test& test) {
  const std::string when = test.on.empty() ? text_of(test.when) : runs_text(test);
  std::vector<std::string> fields;
  for (const Expr& each : test.fields) fields.push_back(print(each));
  const std::string what =
      fields.size() > 1 ? fmt::format("({})", fmt::join(fields, ", ")) : fmt::format("{}", fmt::join(fields, ""));
  switch (test.kind) {
    case Test::Kind::number: return fmt::format("test {} = {}{}", test.quantity.name, print(test.quantity.value), when);
    case Test::Kind::statistic:
      return fmt::format("statistic {} = {}{}", test.quantity.name, print(test.quantity.value), when);
    case Test::Kind::spectrum: return fmt::format("spectrum {} = {}{}", test.quantity.name, what, when);
    case Test::Kind::correlation:
      return fmt::format("correlation {} = {} above {}{}", test.quantity.name, what, test.threshold, when);
  }
  unreachable("kind of test");
}

std::vector<std::string> task_lines(const Task& task) {
  std::vector<std::string> lines;
  for (const Datum& datum : task.data) lines.push_back(text_of(datum));
  for (const Unknown& unknown : task.unknowns) {
    if (unknown.kind == Unknown::Kind::network) {
      lines.push_back(fmt::format("learn {}{}", unknown.name,
                                  unknown.from.file.empty() ? "" : fmt::format(" from \"{}\"", unknown.from.file)));
      continue;
    }
    const std::string bounds = unknown.is_bounded() ? fmt::format(" in {} .. {}", unknown.low, unknown.high) : "";
    const char* initial = unknown.kind == Unknown::Kind::initial ? "initial " : "";
    lines.push_back(fmt::format("unknown {}{} from {}{}", initial, unknown.name, print(unknown.from), bounds));
  }
  for (const Loss& loss : task.losses) {
    const std::string what = loss.average.empty() ? "minimise " : fmt::format("average {} = ", loss.average);
    lines.push_back(what + print(loss.value) + text_of(loss.when));
  }
  if (task.optimiser) lines.push_back(text_of(*task.optimiser, task.training));
  for (const Test& test : task.tests) lines.push_back(text_of(test));
  for (const Test& growth : task.growths) lines.push_back("growth " + growth.quantity.name + runs_text(growth));
  return lines;
}

/// Expressions contain an operator with a given adjoint by its name only: this prints its definition.
std::string text_of(const Operator& function) {
  std::vector<std::string> body;
  for (const Expr& component : function.body) body.push_back(bare(component));
  const std::string value = body.size() == 1 ? body.front() : fmt::format("({})", fmt::join(body, ", "));
  std::string text = fmt::format("operator {}({}) = {}\n", function.name, fmt::join(function.parameters, ", "), value);
  for (const Operator::Adjoint& adjoint : function.adjoints) {
    text +=
        fmt::format("  adjoint {}_bar {} {}\n", adjoint.parameter, adjoint.of_field ? "=" : "+=", bare(adjoint.value));
  }
  return text;
}

/// The operators of a problem, each once.
std::string operators_text(const Problem& problem) {
  std::vector<std::string> texts;
  for_each_formula(problem, [&](const Use& use) {
    if (!is_of_states(use.kind)) return;  // other formulas apply no operators
    any_part(use.formula, [&](const Expr& part) {
      const Apply* apply = as<Apply>(part);
      const std::string text = apply ? text_of(apply->function) : "";
      if (apply && std::find(texts.begin(), texts.end(), text) == texts.end()) texts.push_back(text);
      return false;
    });
  });
  return fmt::format("{}{}", fmt::join(texts, ""), texts.empty() ? "" : "\n");
}

std::string block(const std::string& head, const std::vector<std::string>& lines) {
  return fmt::format("{} {{\n  {}\n}}\n", head, fmt::join(lines, "\n  "));
}

}  // namespace

std::string print(const Expr& expr) { return bare(expr); }

std::string print(const Source& source) {
  if (source.formula) return print(*source.formula);
  return load_text(source.file, source.variable) + (source.time ? fmt::format(" at t = {}", *source.time) : "");
}

std::string print(const Control& control, double step) {
  return fmt::format("{} = {} every {}", control.name, print(control.formula), control.every * step);
}

std::string print(const Coefficient& c, double step) {
  return fmt::format("{} = {}{}", c.name, print(c.value),
                     c.is_control() ? fmt::format(" every {}", c.every * step) : "");
}

std::string print(const Output& output, double step) {
  const std::string every = output.every > 0 ? fmt::format(" every {}", output.every * step) : "";
  return fmt::format("output {}{}", fmt::join(output.fields, ", "), every);
}

std::string print(const Problem& problem) {
  const std::string of = problem.program.empty() ? problem.model : problem.program;
  std::string text;
  for (const network::Network& network : problem.networks) text += print(network) + "\n";
  text += operators_text(problem) +
          block(fmt::format("scene {} : {} with {}", problem.scene, of, problem.scheme.name), scene_lines(problem));
  text += "\n" + print(problem.scheme);
  if (problem.task) {
    text += "\n" + block(fmt::format("task {} : {}", problem.task->name, problem.scene), task_lines(*problem.task));
  }
  return text;
}

}  // namespace dpde::model
