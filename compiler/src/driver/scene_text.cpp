// SPDX-License-Identifier: Apache-2.0
#include "driver/scene_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "model/print_model.h"
#include "stencil/build.h"

namespace dpde::driver {

namespace {

std::string text_of(const model::Source& source) {
  return source.formula ? print(*source.formula) : fmt::format("load(\"{}\")", source.file);
}

bool is_input(const stencil::Interface& interface, const std::string& field) {
  return std::find(interface.inputs.begin(), interface.inputs.end(), field) != interface.inputs.end();
}

}  // namespace

std::string scene_text(const Compiled& compiled) {
  const model::Problem& problem = *compiled.problem;
  const std::string step = compiled.step_name();
  const stencil::Interface interface = stencil::interface_of(compiled.stencil, *compiled.stencil.find_program(step));
  std::string text = fmt::format("scene {} : {} {{\n", problem.scene, step);
  for (const model::Axis& axis : problem.axes) {
    text += fmt::format("  grid {} = {} .. {}, cells {}{}\n", axis.name, axis.low, axis.high, axis.cells,
                        axis.topology == Topology::periodic ? ", periodic" : "");
  }
  for (const model::Parameter& param : problem.params) {
    const std::vector<std::string>& used = interface.params;
    if (std::find(used.begin(), used.end(), param.name) != used.end()) text += fmt::format("  {} = {}\n", param.name, param.value);
  }
  for (const model::Coefficient& coefficient : problem.coefficients) {
    if (is_input(interface, coefficient.name)) text += fmt::format("  {} = {}\n", coefficient.name, text_of(coefficient.value));
  }
  for (const model::State& state : problem.states) {
    if (state.initial.formula || !state.initial.file.empty()) {
      text += fmt::format("  initial {} = {}\n", state.name, text_of(state.initial));
    }
    if (state.exact) text += fmt::format("  exact {} = {}\n", state.name, print(*state.exact));
  }
  text += fmt::format("  time {} .. {}, step {}\n", problem.t_begin, problem.t_begin + problem.steps * problem.step, problem.step);
  for (const model::Quantity& quantity : problem.observables) {
    text += fmt::format("  observe {} = {}\n", quantity.name, print(quantity.value));
  }
  return text + "}\n";
}

}  // namespace dpde::driver
