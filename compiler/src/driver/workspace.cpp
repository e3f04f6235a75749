// SPDX-License-Identifier: Apache-2.0
#include "driver/workspace.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "codegen/network_table.h"
#include "dpde/runtime/layout.h"
#include "dpde/runtime/network.h"
#include "dpde/runtime/random.h"

namespace dpde::driver {

namespace {

dpde_layout layout_for(const std::vector<model::Axis>& axes, const codegen::CompiledModule& code) {
  std::array<std::int64_t, 3> halo{};
  std::int32_t real = DPDE_F64;
  for (const std::string& name : code.names()) {
    const dpde_program& program = *code.find(name);
    for (int a = 0; a < 3; ++a) halo[a] = std::max(halo[a], program.halo[a]);
    real = program.real;
  }
  std::vector<std::int64_t> cells;
  for (const model::Axis& axis : axes) cells.push_back(axis.cells);
  return make_layout(cells, halo, real);
}

std::vector<model::Axis> axes_with(std::vector<model::Axis> axes, const std::vector<int>& cells) {
  for (std::size_t a = 0; a < cells.size() && a < axes.size(); ++a) axes[a].cells = cells[a];
  return axes;
}

std::int64_t coordinate(const Cell& cell, std::size_t axis) { return axis == 0 ? cell.x : axis == 1 ? cell.y : cell.z; }

}  // namespace

Workspace::Workspace(const model::Problem& problem, const codegen::CompiledModule& code, const std::vector<int>& cells,
                     int threads)
    : axes_(axes_with(problem.axes, cells)),
      layout_(layout_for(axes_, code)),
      team_(threads),
      cell_count_(static_cast<std::size_t>(dpde::cell_count(layout_))),
      noises_(problem.noises()),
      t_begin_(problem.t_begin),
      step_(problem.step) {
  for (const model::Parameter& param : problem.params) params_[param.name] = param.value;
  for (const model::Control& control : problem.controls) set_control(control.name, control.every, control.values);
  constexpr const char* spacings[] = {"hx", "hy", "hz"};
  for (std::size_t a = 0; a < axes_.size(); ++a) {
    const model::Axis& axis = axes_[a];
    params_[spacings[a]] = axis.spacing();
    fill_coordinate(field(axis.name), static_cast<int>(a), axis.low, axis.spacing(),
                    axis.topology == Topology::periodic);
  }
  const auto add_weights = [&](const dpde_network& network) {
    const std::vector<double> zero(static_cast<std::size_t>(network.weight_count));
    if (!weights_.contains(network.name)) weights_[network.name] = {initial_weights(network, network.seed), zero, zero};
  };
  // Also of those whose terms were dropped, and of hand-written programs without a problem.
  for (const network::Network& network : problem.networks) add_weights(*codegen::NetworkTable(network).get());
  for (const std::string& name : code.names()) {
    const dpde_program& program = *code.find(name);
    for (int n = 0; n < program.network_count; ++n) add_weights(*program.networks[n]);
  }
  params_["dt"] = problem.step;
  params_["cells"] = static_cast<double>(cell_count_);
  draw_noise(0);
  for (const model::Coefficient& coefficient : problem.coefficients) {
    if (coefficient.is_control())
      add_control_field(coefficient.name, coefficient.every, problem.intervals(coefficient.every));
  }
}

void Workspace::draw_noise(std::uint64_t interval) {
  for (const std::uint64_t seed : noises_) fill_noise(layout_, field(model::noise_name(seed)).base(), seed, interval);
}

Field& Workspace::interval_of(const std::string& name, std::size_t interval) {
  return field(interval == 0 ? name : fmt::format("{}@{}", name, interval));
}

void Workspace::add_control_field(const std::string& name, int every, int count) {
  ControlField& control = control_fields_.emplace_back(ControlField{name, every, {}});
  for (int k = 0; k < count; ++k) control.at.push_back(interval_of(name, static_cast<std::size_t>(k)).base());
}

const ControlField* Workspace::find_control_field(const std::string& name) const {
  const auto found = std::ranges::find(control_fields_, name, &ControlField::name);
  return found == control_fields_.end() ? nullptr : &*found;
}

void Workspace::make_like(const std::string& name, const std::string& like) {
  field(name);
  const ControlField* control = find_control_field(like);
  if (control == nullptr || find_control_field(name) != nullptr) return;
  const int every = control->every, count = static_cast<int>(control->at.size());
  add_control_field(name, every, count);
}

void Workspace::run_for_intervals(const dpde_program& program, const std::string& name) {
  const ControlField control = *find_control_field(name);
  for (std::size_t k = 0; k < control.at.size(); ++k) {
    draw_noise(k);
    execute(program, t_begin_ + (static_cast<double>(k) + 0.5) * control.every * step_, {{name, control.at[k]}});
  }
  draw_noise(0);
}

std::size_t Workspace::interval_at(double t, int every, std::size_t count) const {
  return control_interval(std::llround((t - t_begin_) / step_), every, count);
}

std::vector<std::int64_t> Workspace::shape() const {
  std::vector<std::int64_t> shape;
  for (const model::Axis& axis : axes_) shape.insert(shape.begin(), axis.cells);
  return shape;
}

std::string Workspace::cell_text(const Cell& cell) const {
  std::vector<std::int64_t> numbers;
  for (std::size_t a = 0; a < axes_.size(); ++a) numbers.push_back(coordinate(cell, a));
  return fmt::format("{}", fmt::join(numbers, ", "));
}

std::string Workspace::place_text(const Cell& cell) const {
  std::vector<std::string> parts;
  for (std::size_t a = 0; a < axes_.size(); ++a) {
    parts.push_back(fmt::format("{} = {:.6g}", axes_[a].name, axes_[a].centre(coordinate(cell, a))));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

Field& Workspace::field(const std::string& name) {
  std::unique_ptr<Field>& slot = fields_[name];
  if (!slot) slot = std::make_unique<Field>(layout_, static_cast<int>(fields_.size()) - 1);
  return *slot;
}

void Workspace::release(const dpde_program& program) {
  for (int f = program.input_count; f < program.field_count; ++f) fields_.erase(program.fields[f]);
}

std::vector<std::string> Workspace::field_names() const {
  std::vector<std::string> names;
  for (const auto& [name, field] : fields_) names.push_back(name);
  return names;
}

std::vector<double> Workspace::dense(const std::string& name) {
  const ControlField* control = find_control_field(name);
  const std::size_t count = control == nullptr ? 1 : control->at.size();
  std::vector<double> values(count * cell_count_);
  for (std::size_t k = 0; k < count; ++k)
    interval_of(name, k).copy_out(std::span(values).subspan(k * cell_count_, cell_count_));
  return values;
}

void Workspace::set_dense(const std::string& name, std::span<const double> values) {
  const ControlField* control = find_control_field(name);
  if (control == nullptr) return field(name).copy_in(values);
  for (std::size_t k = 0; k < control->at.size(); ++k)
    interval_of(name, k).copy_in(values.subspan(k * cell_count_, cell_count_));
}

void Workspace::set_control(const std::string& name, int every, std::vector<double> values) {
  params_[name] = values.front();
  controls_[name] = {every, std::move(values)};
}

/// 0 for what nobody has set, as directions of derivatives.
double Workspace::param_at(const std::string& name, double t) const {
  if (name == "t") return t;
  const auto control = controls_.find(name);
  if (control != controls_.end()) {
    const auto& [every, values] = control->second;
    return values[interval_at(t, every, values.size())];
  }
  const auto value = params_.find(name);
  return value == params_.end() ? 0 : value->second;
}

const Executor& Workspace::execute(const dpde_program& program, double t, const std::map<std::string, void*>& bound) {
  std::unique_ptr<Executor>& executor = executors_[&program];
  if (!executor) executor = std::make_unique<Executor>(program, layout_, team_);
  for (int f = 0; f < program.field_count; ++f) {
    const auto given = bound.find(program.fields[f]);
    if (given != bound.end()) {
      executor->bind(f, given->second);
      continue;
    }
    const ControlField* control = find_control_field(program.fields[f]);
    executor->bind(f, control != nullptr ? control->at[interval_at(t, control->every, control->at.size())]
                                         : field(program.fields[f]).base());
  }
  for (int p = 0; p < program.param_count; ++p) {
    executor->set_param(p, param_at(program.params[p], t));
  }
  for (int n = 0; n < program.network_count; ++n) {
    Weights& weights = weights_.at(program.networks[n]->name);
    std::ranges::fill(weights.bars, 0.0);
    executor->bind_weights(n, weights.bound());
  }
  executor->update_weights();
  executor->update_uniforms();
  executor->prepare();
  executor->run();
  return *executor;
}

std::map<std::string, double> Workspace::run(const dpde_program& program, double t,
                                             const std::map<std::string, void*>& bound) {
  const Executor& executor = execute(program, t, bound);
  std::map<std::string, double> sums;
  for (int s = 0; s < program.sum_count; ++s) sums[program.sums[s]] = executor.sums()[static_cast<std::size_t>(s)];
  return sums;
}

}  // namespace dpde::driver
