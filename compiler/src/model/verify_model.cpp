// SPDX-License-Identifier: Apache-2.0
#include "model/verify_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>

#include "model/analyse/placement.h"
#include "model/build.h"
#include "model/uses.h"
#include "support/assert.h"
#include "support/match.h"
#include "support/maths/comparisons.h"

namespace dpde::model {

namespace {

/// What an expression may contain besides numbers and parameters.
struct Allowed {
  bool fields = false, coordinates = false, time = false, derivatives = false, reductions = false, noise = false,
       networks = false;
};
constexpr Allowed equation{true, true, true, true, true};
constexpr Allowed place{false, true, false, false, false};
constexpr Allowed formula{false, true, false, false, false, true, true};
constexpr Allowed formula_of_time{false, true, true, false, false, true};
constexpr Allowed exact{false, true, true, false, false};
constexpr Allowed at_wall{true, true, true, false, false};
constexpr Allowed start{false, false, false, false, false};
constexpr Allowed weight{false, false, true, false, false};
constexpr Allowed quantity{true, true, true, true, true};

class Verifier {
 public:
  explicit Verifier(const Problem& problem) : problem_(problem) {}

  std::vector<std::string> run() {
    check_axes();
    check_time();
    collect_names();
    check_states();
    check_controls();
    check_events();
    check_projections();
    for (const Coefficient& c : problem_.coefficients) check_source(c.value, "coefficient " + c.name);
    if (problem_.task) check_task(*problem_.task);
    for_each_formula(problem_, [&](const Use& use) { check(use); });
    check_placements();
    return mistakes_;
  }

 private:
  void demand(bool condition, std::string mistake) {
    if (!condition) mistakes_.push_back(std::move(mistake));
  }

  void check_axes() {
    demand(!problem_.axes.empty() && problem_.axes.size() <= 3, fmt::format("{} axes", problem_.axes.size()));
    for (std::size_t i = 0; i < problem_.axes.size() && i < 3; ++i) {
      const Axis& axis = problem_.axes[i];
      demand(axis.name == std::string(1, "xyz"[i]), fmt::format("axis {} is called {}", i, axis.name));
      demand(axis.cells >= 1, fmt::format("axis {} has {} cells", axis.name, axis.cells));
      demand(std::isfinite(axis.low) && std::isfinite(axis.high) && axis.low < axis.high,
             fmt::format("axis {} reaches from {} to {}", axis.name, axis.low, axis.high));
    }
  }

  void check_time() {
    demand(std::isfinite(problem_.t_begin), "the run begins at no time");
    demand(std::isfinite(problem_.step) && problem_.step > 0, fmt::format("the step is {}", problem_.step));
    demand(problem_.substeps.courant >= 0 && (problem_.substeps.courant > 0) == problem_.substeps.rate.has_value(),
           "a Courant number without a rate");
    if (problem_.substeps.control) {
      const StepControl& control = *problem_.substeps.control;
      demand(control.relative > 0 && control.absolute > 0 && control.first > 0, "a tolerance that is not positive");
      demand(estimates_error(problem_.scheme.time) && !problem_.substeps.rate, "nothing estimates the error of steps");
    }
    demand(problem_.steps > 0, fmt::format("the run has {} steps", problem_.steps));
  }

  void add_name(std::set<std::string>& names, const std::string& name) {
    demand(!name.empty(), "a thing without name");
    demand(!fields_.contains(name) && !params_.contains(name), fmt::format("two things are called {}", name));
    names.insert(name);
  }

  void collect_names() {
    for (const State& state : problem_.states) add_name(fields_, state.name);
    for (const Coefficient& coefficient : problem_.coefficients) add_name(fields_, coefficient.name);
    for (const Parameter& param : problem_.params) {
      add_name(params_, param.name);
      demand(std::isfinite(param.value), fmt::format("parameter {} is {}", param.name, param.value));
      if (param.unknown) unknowns_.insert(param.name);
    }
  }

  void check_states() {
    demand(!problem_.states.empty(), "there is no state");
    demand(problem_.model.empty() != problem_.program.empty(), "the step is a model or a program");
    for (const State& state : problem_.states) {
      demand(state.rhs.has_value() == (problem_.program.empty() && state.history_of.empty()),
             fmt::format("state {} has {} equation", state.name, state.rhs ? "an" : "no"));
      check_source(state.initial, "initial state of " + state.name);
      demand(state.boundary.size() == problem_.axes.size(),
             fmt::format("state {} has boundaries on {} axes", state.name, state.boundary.size()));
    }
  }

  void check_controls() {
    for (const Control& control : problem_.controls) {
      demand(params_.contains(control.name), fmt::format("control {} is no parameter", control.name));
      demand(control.every >= 1, fmt::format("control {} has intervals of {} steps", control.name, control.every));
      const auto count = static_cast<std::size_t>((problem_.steps - 1) / std::max(control.every, 1) + 1);
      demand(control.values.size() == count,
             fmt::format("control {} has {} values", control.name, control.values.size()));
      demand(control.start.empty() || control.start.size() == count,
             fmt::format("control {} has {} starts", control.name, control.start.size()));
    }
  }

  void check_events() {
    for (const Event& event : problem_.events) {
      demand(event.after_step || event.every > 0 || !event.at.empty(), "an event that never happens");
      for (const int step : event.at) demand(step >= 1, fmt::format("an event behind step {}", step));
      for (const Event::Update& update : event.updates) {
        demand(problem_.find_state(update.state) != nullptr, fmt::format("an event changes {}", update.state));
      }
    }
  }

  void check_projections() {
    for (const Projection& projection : problem_.projections) {
      if (const std::optional<Expr>& potential = projection.potential) {
        demand(problem_.find_state(projection.multiplier) != nullptr,
               fmt::format("a constraint gives {}", projection.multiplier));
        demand(is<Solve>(*potential), "a constraint without a solve");
      }
      demand(projection.potential || !projection.is_increment(), "an increment of nothing");
      for (const Event::Update& update : projection.updates) {
        demand(problem_.find_state(update.state) != nullptr, fmt::format("a constraint changes {}", update.state));
      }
    }
  }

  void check_source(const Source& source, const std::string& where) {
    demand(source.formula.has_value() == source.file.empty(), where + ": neither a formula nor a file, or both");
  }

  void check_task(const Task& task) {
    for (const Datum& datum : task.data) {
      demand(datum.scene.empty() == datum.field.empty() && datum.scene.empty() != datum.file.empty(),
             fmt::format("datum {} comes from a file or from a scene", datum.name));
      add_name(fields_, datum.name);
    }
    demand(task.unknowns.empty() == task.losses.empty(), "a task has unknowns and losses");
    for (const Unknown& unknown : task.unknowns) {
      demand(exists(unknown), fmt::format("unknown {} is nothing", unknown.name));
      if (unknown.kind != Unknown::Kind::network) check_source(unknown.from, "start of " + unknown.name);
    }
    for (const Loss& loss : task.losses) {
      check_when(loss.when, "loss");
      if (!loss.average.empty()) add_name(params_, loss.average);
    }
    for (const Test& test : task.tests) {
      if (test.on.empty()) check_when(test.when, "test " + test.quantity.name);
    }
    if (!task.optimiser) return;
    demand(task.optimiser->iterations >= 1, "the optimiser has no iterations");
    const bool needs_rate =
        task.optimiser->kind == Optimiser::Kind::gradient_descent || task.optimiser->kind == Optimiser::Kind::adam;
    demand(!needs_rate || task.optimiser->rate > 0, "the optimiser has no rate");
  }

  bool exists(const Unknown& unknown) const {
    switch (unknown.kind) {
      case Unknown::Kind::parameter: return unknowns_.contains(unknown.name);
      case Unknown::Kind::control:
        return unknowns_.contains(unknown.name) && problem_.find_control(unknown.name) != nullptr;
      case Unknown::Kind::initial: return problem_.find_state(unknown.name) != nullptr;
      case Unknown::Kind::coefficient: return problem_.find_coefficient(unknown.name) != nullptr;
      case Unknown::Kind::network: return problem_.find_network(unknown.name) != nullptr;
    }
    unreachable("kind of unknown");
  }

  void check_when(const When& when, const std::string& where) {
    demand((when.kind == When::Kind::at) != when.times.empty(), where + ": times without at, or at without times");
    for (const double time : when.times) {
      const double place = (time - problem_.t_begin) / problem_.step;
      demand(place > -0.5 && place < problem_.steps + 0.5 && std::abs(place - std::round(place)) < 1e-3,
             fmt::format("{}: t = {} is no state of the run", where, time));
    }
  }

  void check(const Use& use) {
    if (use.kind == UseKind::stated_operator) return;  // its arguments have unique names that are unknown elsewhere
    const std::string where = description(use);
    const bool wants_condition = use.kind == UseKind::held_where;
    demand(is_condition(use.formula) == wants_condition,
           where + (wants_condition ? ": a number stands where a condition is needed"
                                    : ": a condition stands where a number is needed"));
    check_node(use.formula, where, allowed_in(use));
  }

  Allowed allowed_in(const Use& use) const {
    switch (use.kind) {
      case UseKind::equation:
      case UseKind::potential:
      case UseKind::constraint:
      case UseKind::correction:
      case UseKind::held_where:
      case UseKind::held_value:
      case UseKind::event:
      case UseKind::courant_rate:
      case UseKind::output:
      case UseKind::stated_operator: return equation;
      case UseKind::observable:
      case UseKind::loss:
      case UseKind::test:
      case UseKind::test_field: return quantity;
      case UseKind::initial: return formula;
      case UseKind::coefficient: return of_coefficient(use.owner);
      case UseKind::unknown_start: return at_start(use.owner);
      case UseKind::exact: return exact;
      case UseKind::boundary_value: return at_wall;
      case UseKind::boundary_weight:
      case UseKind::control:
      case UseKind::control_start: return weight;
      case UseKind::stretch_map:
      case UseKind::metric: return place;
    }
    unreachable("kind of use");
  }

  Allowed of_coefficient(const std::string& name) const {
    return problem_.find_coefficient(name)->is_control() ? formula_of_time : formula;
  }

  Allowed at_start(const std::string& unknown) const {
    const Unknown& sought = *std::ranges::find(problem_.task->unknowns, unknown, &Unknown::name);
    switch (sought.kind) {
      case Unknown::Kind::initial: return formula;
      case Unknown::Kind::coefficient:
        return problem_.find_coefficient(unknown) != nullptr ? of_coefficient(unknown) : formula;
      case Unknown::Kind::control: return weight;
      case Unknown::Kind::parameter:
      case Unknown::Kind::network: return start;
    }
    unreachable("kind of unknown");
  }

  static std::string description(const Use& use) {
    switch (use.kind) {
      case UseKind::equation: return "equation of " + use.owner;
      case UseKind::potential:
      case UseKind::constraint:
      case UseKind::correction: return "constraint of " + use.owner;
      case UseKind::held_where: return "mask of " + use.owner;
      case UseKind::held_value: return "held value of " + use.owner;
      case UseKind::event: return "event of " + use.owner;
      case UseKind::courant_rate: return "rate";
      case UseKind::observable: return "observable " + use.owner;
      case UseKind::output: return "shown " + use.owner;
      case UseKind::loss: return "loss";
      case UseKind::test:
      case UseKind::test_field: return "test " + use.owner;
      case UseKind::initial: return "initial state of " + use.owner;
      case UseKind::coefficient: return "coefficient " + use.owner;
      case UseKind::control:
      case UseKind::control_start: return "control " + use.owner;
      case UseKind::unknown_start: return "start of " + use.owner;
      case UseKind::exact: return "exact solution of " + use.owner;
      case UseKind::boundary_value:
      case UseKind::boundary_weight: return "boundary of " + use.owner;
      case UseKind::stretch_map: return "stretched axis " + use.owner;
      case UseKind::metric: return "coordinates " + use.owner;
      case UseKind::stated_operator: return "operator " + use.owner;
    }
    unreachable("kind of use");
  }

  /// Children of `e` must be numbers, except the first of a select and those of and, or.
  void check_children(const Expr& e, const std::string& where, Allowed allowed) {
    const auto* select = as<Select>(e);
    const auto* b = as<Binary>(e);
    bool first = true;
    for_each_child(e, [&](const Expr& part) {
      const bool wants_condition = (select && first) || (b && is_logical(b->op));
      demand(is_condition(part) == wants_condition, where + ": a condition and a number are mixed up");
      first = false;
      check_node(part, where, allowed);
    });
  }

  void check_node(const Expr& e, const std::string& where, Allowed allowed) {
    const auto need = [&](bool is_allowed, const char* what) {
      demand(is_allowed, where + ": " + what + " cannot stand here");
    };
    match(
        e->kind, [&](const Number& n) { demand(std::isfinite(n.value), where + ": a number is not finite"); },
        [&](const Param& p) {
          if (p.name == "t") need(allowed.time, "t");
          if (p.name == "hx" || p.name == "hy" || p.name == "hz") return need(allowed.derivatives, "a spacing");
          demand(p.name == "t" || params_.contains(p.name), fmt::format("{}: there is no parameter {}", where, p.name));
        },
        [&](const Field& f) {
          need(allowed.fields, "a field");
          demand(fields_.contains(f.name), where + ": there is no field " + f.name);
        },
        [&](const Coordinate& c) {
          need(allowed.coordinates, "a coordinate");
          demand(has_axis(c.axis), fmt::format("{}: there is no axis {}", where, c.axis));
        },
        [&](const Noise&) { need(allowed.noise, "noise"); }, ignored<Neg, Binary, Select>,
        [&](const Call& c) {
          demand(static_cast<int>(c.arguments.size()) == arity(c.fn),
                 fmt::format("{}: {} has {} arguments", where, name_of(c.fn), c.arguments.size()));
        },
        [&](const Derivative& d) {
          need(allowed.derivatives, "a derivative");
          demand(has_axis(d.axis) && (d.order == 1 || d.order == 2),
                 fmt::format("{}: derivative of order {} along axis {}", where, d.order, d.axis));
        },
        [&](const Advect& a) {
          need(allowed.derivatives, "advection");
          demand(a.velocity.size() == problem_.axes.size(),
                 fmt::format("{}: velocity of {} components", where, a.velocity.size()));
        },
        [&](const Shift& s) {
          need(allowed.derivatives, "a neighbour");
          demand(s.offset.size() == problem_.axes.size(), fmt::format("{}: {} offsets", where, s.offset.size()));
        },
        [&](const Interpolate&) { need(allowed.derivatives, "an interpolation"); },
        [&](const BandPass&) { need(allowed.derivatives, "waves"); },
        [&](const Sample& s) {
          need(allowed.fields, "a field");
          demand(fields_.contains(s.field), fmt::format("{}: there is no field {}", where, s.field));
          demand(s.place.size() == problem_.axes.size(),
                 fmt::format("{}: sampled at {} coordinates", where, s.place.size()));
          // on a stretched axis the position is a sum over all cells
          for (const Expr& part : s.place)
            demand(is_uniform(part) || holds_any<Reduce>(part), where + ": sampled at a place that varies");
        },
        [&](const Reduce& r) { need(allowed.reductions, "a reduction"), check_axes(r, where); },
        [&](const Apply& a) {
          need(allowed.derivatives, "an operator");
          check_application(a, where);
        },
        [&](const NetworkCall&) { need(allowed.reductions || allowed.networks, "a network"); },
        [&](const Solve& s) { need(allowed.derivatives && check_solve(s, where), "a solve"); });
    check_children(e, where, allowed);
  }

  /// Afterwards the name is known, since the solve's own equation contains it.
  bool check_solve(const Solve& s, const std::string& where) {
    demand(s.boundary.size() == problem_.axes.size(), fmt::format("{}: {} has other axes", where, s.name));
    fields_.insert(s.name);
    return true;
  }

  void check_application(const Apply& a, const std::string& where) {
    demand(a.arguments.size() == a.function.parameters.size() && a.places.size() == a.arguments.size(),
           fmt::format("{}: {} has {} arguments", where, a.function.name, a.arguments.size()));
    demand(a.component >= 0 && a.component < static_cast<int>(a.function.body.size()) &&
               a.results.size() == a.function.body.size(),
           fmt::format("{}: component {} of {}", where, a.component, a.function.name));
  }

  void check_axes(const Reduce& r, const std::string& where) {
    bool is_along_an_axis = r.is_over_all();
    for (int axis = 0; axis < 3; ++axis) {
      const bool over = r.over[static_cast<std::size_t>(axis)];
      is_along_an_axis = is_along_an_axis || over;
      demand(!over || has_axis(axis) || r.is_over_all(), fmt::format("{}: a reduction along axis {}", where, axis));
    }
    demand(is_along_an_axis, where + ": a reduction along no axis");
  }

  void check_placements() {
    const Placements placements(problem_);
    for (const State& state : problem_.states) {
      for (std::size_t axis = 0; axis < state.placement.size(); ++axis) {
        demand(!state.placement[axis] || axis < problem_.axes.size(),
               fmt::format("{} is staggered along no axis", state.name));
      }
      if (state.rhs)
        demand(!placements.find_mistake(*state.rhs, state.placement),
               fmt::format("equation of {}: placements are mixed", state.name));
    }
  }

  bool has_axis(int axis) const { return axis >= 0 && axis < static_cast<int>(problem_.axes.size()); }

  const Problem& problem_;
  std::set<std::string> fields_, params_, unknowns_;
  std::vector<std::string> mistakes_;
};

}  // namespace

std::vector<std::string> verify(const Problem& problem) { return Verifier(problem).run(); }

}  // namespace dpde::model
