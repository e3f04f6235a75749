// SPDX-License-Identifier: Apache-2.0
// Simulation: what is computed of the present state, observables and outputs.
#include <algorithm>

#include "simulation_impl.h"

namespace dpde {

double Simulation::Impl::observe(std::string_view name) {
  begin_stepping();
  const dpde_program* program = engine.scene().observe;
  int sum = -1;
  for (int32_t s = 0; program != nullptr && s < program->sum_count; ++s) {
    if (name == program->sums[s]) sum = s;
  }
  if (sum < 0) {
    std::vector<std::string> known;
    for (int32_t s = 0; program != nullptr && s < program->sum_count; ++s) known.emplace_back(program->sums[s]);
    no_such(engine.scene(), "observable", name, known);
  }
  return engine.workspace().execute(*program, time(), present()).sums()[static_cast<std::size_t>(sum)];
}

Workspace::Bound Simulation::Impl::present() {
  Workspace::Bound bound;
  for (std::size_t s = 0; s < engine.states().size(); ++s)
    bound[engine.states()[s].name] = engine.stepper().present()[s];
  return bound;
}

std::span<const dpde_output> Simulation::Impl::outputs() const {
  const dpde_scene& scene = engine.scene();
  return {scene.outputs, static_cast<std::size_t>(scene.output_count)};
}

std::vector<double> Simulation::Impl::output(std::string_view name) {
  const auto found =
      std::ranges::find(outputs(), name, [](const dpde_output& one) { return std::string_view(one.name); });
  if (found == outputs().end()) {
    std::vector<std::string> known;
    for (const dpde_output& one : outputs()) known.emplace_back(one.name);
    no_such(engine.scene(), "output with a formula", name, known);
  }
  begin_stepping();
  const dpde_program& program = *engine.scene().output_program;
  engine.workspace().execute(program, time(), present());
  std::vector<double> values = engine.workspace().dense(found->field);
  engine.workspace().release(program);
  return values;
}

double Simulation::observe(std::string_view name) {
  return impl_->explained([&] { return impl_->observe(name); });
}

std::vector<double> Simulation::output(std::string_view name) {
  return impl_->explained([&] { return impl_->output(name); });
}

std::vector<std::string> Simulation::outputs() const {
  std::vector<std::string> names;
  for (const dpde_output& one : impl_->outputs()) names.emplace_back(one.name);
  return names;
}

const char* Simulation::unit(std::string_view name) const {
  const dpde_scene& scene = impl_->engine.scene();
  for (const dpde_unit& known : std::span(scene.units, static_cast<std::size_t>(scene.unit_count))) {
    const std::string_view own = known.name;
    const bool is_component = own.starts_with(name) && own.substr(name.size()).starts_with('.');
    if (own == name || is_component) return known.unit;
  }
  return "";
}

}  // namespace dpde
