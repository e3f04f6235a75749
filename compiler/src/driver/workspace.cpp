// SPDX-License-Identifier: Apache-2.0
#include "driver/workspace.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "dpde/runtime/layout.h"
#include "dpde/runtime/rollout.h"

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
    : axes_(axes_with(problem.axes, cells)), layout_(layout_for(axes_, code)), threads_(threads),
      cell_count_(static_cast<std::size_t>(dpde::cell_count(layout_))), t_begin_(problem.t_begin), step_(problem.step) {
  for (const model::Parameter& param : problem.params) params_[param.name] = param.value;
  for (const model::Control& control : problem.controls) set_control(control.name, control.every, control.values);
  constexpr const char* spacings[] = {"hx", "hy", "hz"};
  for (std::size_t a = 0; a < axes_.size(); ++a) {
    const model::Axis& axis = axes_[a];
    params_[spacings[a]] = axis.spacing();
    fill_coordinate(field(axis.name), static_cast<int>(a), axis.low, axis.spacing(), axis.topology == Topology::periodic);
  }
  params_["dt"] = problem.step;
  params_["cells"] = static_cast<double>(cell_count_);
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

std::vector<std::string> Workspace::field_names() const {
  std::vector<std::string> names;
  for (const auto& [name, field] : fields_) names.push_back(name);
  return names;
}

std::vector<double> Workspace::dense(const std::string& name) {
  std::vector<double> values(cell_count_);
  field(name).copy_out(values);
  return values;
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
    return values[control_interval(std::llround((t - t_begin_) / step_), every, values.size())];
  }
  const auto value = params_.find(name);
  return value == params_.end() ? 0 : value->second;
}

const Executor& Workspace::execute(const dpde_program& program, double t, const std::map<std::string, void*>& bound) {
  std::unique_ptr<Executor>& executor = executors_[&program];
  if (!executor) executor = std::make_unique<Executor>(program, layout_, threads_);
  for (int f = 0; f < program.field_count; ++f) {
    const auto given = bound.find(program.fields[f]);
    executor->bind(f, given != bound.end() ? given->second : field(program.fields[f]).base());
  }
  for (int p = 0; p < program.param_count; ++p) {
    executor->set_param(p, param_at(program.params[p], t));
  }
  executor->update_uniforms();
  executor->prepare();
  executor->run();
  return *executor;
}

std::map<std::string, double> Workspace::run(const dpde_program& program, double t, const std::map<std::string, void*>& bound) {
  const Executor& executor = execute(program, t, bound);
  std::map<std::string, double> sums;
  for (int s = 0; s < program.sum_count; ++s) sums[program.sums[s]] = executor.sums()[static_cast<std::size_t>(s)];
  return sums;
}

}  // namespace dpde::driver
