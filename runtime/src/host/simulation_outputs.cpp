// SPDX-License-Identifier: Apache-2.0
// Simulation: observables and outputs of the present state.
#include <algorithm>

#include "dpde/runtime/bytes.h"
#include "host/simulation_impl.h"

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

std::vector<std::vector<double>> Simulation::Impl::output_values() {
  std::vector<std::vector<double>> values;
  if (outputs().empty()) return values;
  begin_stepping();
  const dpde_program& program = *engine.scene().output_program;
  engine.workspace().execute(program, time(), present());
  for (const dpde_output& output : outputs()) values.push_back(engine.workspace().dense(output.field));
  engine.workspace().release(program);
  return values;
}

std::uint64_t Simulation::Impl::start_hash() {
  engine.update_formulas();
  const double begin = engine.t_begin();
  std::uint64_t hash = hash_bytes(&begin, sizeof begin);
  const auto add = [&](std::span<const double> values) { hash = hash_bytes(values.data(), values.size_bytes(), hash); };
  std::vector<double> state(engine.workspace().cell_count());
  for (std::size_t s = 0; s < engine.states().size(); ++s) {
    engine.initial(s).copy_out(state);
    add(state);
  }
  for (const auto& [name, control] : engine.workspace().controls()) add(control.values);
  for (const auto& [name, weights] : engine.workspace().weights()) add(weights.values);
  const dpde_scene& scene = engine.scene();
  for (const dpde_coefficient& one : std::span(scene.coefficients, static_cast<std::size_t>(scene.coefficient_count))) {
    const auto given = engine.given().find(std::string_view(one.name));
    if (given != engine.given().end() && given->second.is_given) add(engine.workspace().dense(one.name));
  }
  return hash;
}

double Simulation::observe(std::string_view name) {
  return impl_->explained([&] { return impl_->observe(name); });
}

std::vector<double> Simulation::output(std::string_view name) {
  const std::vector<std::string> known = outputs();
  const auto found = std::ranges::find(known, name);
  if (found == known.end()) no_such(impl_->engine.scene(), "output with a formula", name, known);
  return std::move(output_values()[static_cast<std::size_t>(found - known.begin())]);
}

std::vector<std::vector<double>> Simulation::output_values() {
  return impl_->explained([&] { return impl_->output_values(); });
}

std::uint64_t Simulation::start_hash() {
  return impl_->explained([&] { return impl_->start_hash(); });
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
