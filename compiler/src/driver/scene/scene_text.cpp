// SPDX-License-Identifier: Apache-2.0
#include "driver/scene/scene_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>

#include "model/analyse/placement.h"
#include "model/build.h"
#include "model/print/print_model.h"
#include "stencil/build.h"
#include "support/contains.h"
#include "support/match.h"

namespace dpde::driver {

namespace {

using Values = std::map<std::string, double>;

/// Replaces parameters that no program of the scene takes by their values: a scene of programs only knows the others.
model::Expr with_values(const model::Expr& e, const Values& values) {
  const auto all = [&](std::vector<model::Expr> parts) {
    for (model::Expr& part : parts) part = with_values(part, values);
    return parts;
  };
  const auto same = [&](const auto&) { return e; };
  return match(
      e->kind, [&](const model::Number& n) { return same(n); }, [&](const model::Field& f) { return same(f); },
      [&](const model::Coordinate& c) { return same(c); }, [&](const model::Noise& n) { return same(n); },
      [&](const model::Param& p) { return values.contains(p.name) ? model::number(values.at(p.name)) : e; },
      [&](const model::Neg& n) { return model::negate(with_values(n.operand, values)); },
      [&](const model::Binary& b) {
        return model::binary(b.op, with_values(b.left, values), with_values(b.right, values));
      },
      [&](const model::Call& c) { return model::call(c.fn, all(c.arguments)); },
      [&](const model::Select& s) {
        return model::select(with_values(s.condition, values), with_values(s.yes, values), with_values(s.no, values));
      },
      [&](const model::Derivative& d) { return model::derivative(with_values(d.operand, values), d.axis, d.order); },
      [&](const model::Advect& a) { return model::advect(all(a.velocity), with_values(a.operand, values)); },
      [&](const model::Shift& s) { return model::shift(with_values(s.operand, values), s.offset); },
      [&](const model::Interpolate& i) { return model::interpolate(with_values(i.operand, values)); },
      [&](const model::BandPass& b) {
        return model::band_pass({with_values(b.operand, values), b.first, b.last, b.unit});
      },
      [&](const model::Sample& s) {
        return model::sample({s.field, all(s.place), s.along});
      },
      [&](const model::Reduce& r) {
        return model::reduce(model::Reduce{r.reduction, with_values(r.operand, values), r.over});
      },
      [&](const model::Apply& a) {
        return model::apply({a.function, all(a.arguments), a.component, a.places, a.results});
      },
      [&](const model::NetworkCall& i) {  // below the model level outputs have no names
        return model::network_call(
            {i.network, all(i.arguments), i.output, i.outputs, i.outputs == 1 ? "" : fmt::format("c{}", i.output + 1)});
      },
      [&](const model::Solve& s) {
        return model::solve({s.name, with_values(s.operation, values), with_values(s.right, values), s.boundary});
      });
}

std::string text_of(const model::Source& source, const Values& values) {
  return source.formula ? print(with_values(*source.formula, values)) : print(source);
}

/// Parameters and fields that the scene's programs take, first of the step, then of the others, so that the text reads
/// back to itself.
struct Taken {
  std::vector<std::string> params, fields;
};

Taken taken_by(const Compiled& compiled) {
  std::vector<std::string> programs{compiled.step_name()};
  for (const std::string& name : compiled.primal_programs) {
    if (name != programs.front()) programs.push_back(name);
  }
  Taken taken;
  const auto add = [](std::vector<std::string>& to, const std::vector<std::string>& names) {
    for (const std::string& name : names) {
      if (!contains(to, name)) to.push_back(name);
    }
  };
  for (const std::string& name : programs) {
    const stencil::Program* program = compiled.stencil.find_program(name);
    if (program == nullptr) continue;
    const stencil::Interface interface = stencil::interface_of(compiled.stencil, *program);
    add(taken.params, interface.params);
    add(taken.fields, interface.inputs);
  }
  return taken;
}

/// Reasons why the scene cannot be written as a scene of a program.
std::vector<std::string> beyond_scene_text(const model::Problem& problem) {
  std::vector<std::string> reasons;
  const auto add = [&](bool is_there, const std::string& what) {
    if (is_there) reasons.push_back(what);
  };
  add(!problem.events.empty(), "events");
  add(problem.substeps.rate.has_value(), "steps that a Courant number splits");
  add(problem.substeps.control.has_value(), "a tolerance");
  for (const model::Control& control : problem.controls) add(true, "the control " + control.name);
  for (const model::Coefficient& field : problem.coefficients) add(field.is_control(), "the control " + field.name);
  add(problem.scheme.real != Precision::f64, fmt::format("real = {}", name_of(problem.scheme.real)));
  add(problem.metric.has_value(), problem.metric ? problem.metric->name : "");
  add(model::Placements(problem).is_staggered(), "fields that are not at cell centres");
  for (const model::Axis& axis : problem.axes) {
    add(axis.stretch.has_value(), "the stretched axis " + axis.name);
    add(axis.runs_down(), fmt::format("the axis {}, which runs down", axis.name));
  }
  for (const model::Quantity& quantity : problem.observables) {
    add(any_part(quantity.value, [](const model::Expr& e) { return is<model::Shift, model::Apply>(e); }),
        "the operator in " + quantity.name);
    add(any_part(quantity.value, [](const model::Expr& e) { return is<model::Solve>(e); }),
        "what is solved for in " + quantity.name);
  }
  for (const model::OutputField& shown : problem.shown) add(true, "the output of " + shown.name);
  return reasons;
}

}  // namespace

std::string scene_text(const Compiled& compiled) {
  const model::Problem& problem = *compiled.problem;
  const std::vector<std::string> reasons = beyond_scene_text(problem);
  if (!reasons.empty())
    return fmt::format("# scene {} is left out: that of a program has no words for {}\n", problem.scene,
                       fmt::join(reasons, ", "));
  const Taken taken = taken_by(compiled);
  std::string text = problem.task ? fmt::format("# task {} is left out: its losses are programs\n", problem.task->name)
                                  : std::string();
  text += fmt::format("scene {} : {} {{\n", problem.scene, compiled.step_name());
  for (const model::Axis& axis : problem.axes) {
    text += fmt::format("  grid {} = {} .. {}, cells {}{}\n", axis.name, axis.low, axis.high, axis.cells,
                        axis.topology == Topology::periodic ? ", periodic" : "");
  }
  Values values;
  for (const model::Parameter& param : problem.params) {
    if (!contains(taken.params, param.name)) values[param.name] = param.value;
  }
  for (const std::string& name : taken.params) {
    if (const model::Parameter* param = problem.find_param(name))
      text += fmt::format("  {} = {}\n", name, param->value);
  }
  for (const model::Axis& axis : problem.axes) values["h" + axis.name] = axis.spacing();
  for (const model::Coefficient& coefficient : problem.coefficients) {
    if (contains(taken.fields, coefficient.name))
      text += fmt::format("  {} = {}\n", coefficient.name, text_of(coefficient.value, values));
  }
  for (const model::GivenWeights& given : problem.weights)
    text += fmt::format("  {} = load(\"{}\")\n", given.network, given.from.file);
  for (const model::State& state : problem.states) {
    if (state.initial.formula || !state.initial.file.empty()) {
      text += fmt::format("  initial {} = {}\n", state.name, text_of(state.initial, values));
    }
    if (state.exact) text += fmt::format("  exact {} = {}\n", state.name, print(with_values(*state.exact, values)));
  }
  text += fmt::format("  time {} .. {}, step {}{}\n", problem.t_begin, problem.t_begin + problem.steps * problem.step,
                      problem.step, problem.steady > 0 ? fmt::format(", until steady {}", problem.steady) : "");
  if (problem.accuracy) {
    const std::vector<std::string>& states = problem.accuracy->states;
    text += fmt::format("  accuracy {}{}\n", problem.accuracy->tolerance,
                        states.empty() ? "" : fmt::format(" on {}", fmt::join(states, ", ")));
  }
  for (const model::Quantity& quantity : problem.observables) {
    text += fmt::format("  observe {} = {}\n", quantity.name, print(with_values(quantity.value, values)));
  }
  for (const model::Output& output : problem.outputs) text += fmt::format("  {}\n", print(output, problem.step));
  return text + "}\n";
}

}  // namespace dpde::driver
