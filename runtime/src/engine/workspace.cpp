// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/workspace.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "dpde/runtime/allocation.h"
#include "dpde/runtime/layout.h"
#include "dpde/runtime/links.h"
#include "dpde/runtime/network.h"
#include "dpde/runtime/random.h"

namespace dpde {

Workspace::Workspace(Setup setup)
    : setup_(std::move(setup)), cell_count_(static_cast<std::size_t>(dpde::cell_count(setup_.layout))) {
  constexpr const char* spacings[] = {"hx", "hy", "hz"};
  for (const BoundParam& param : setup_.params) params_[param.name] = param.value;
  for (const auto& [name, control] : setup_.controls) params_[name] = control.values.front();
  for (std::size_t a = 0; a < setup_.axes.size(); ++a) {
    const Axis& axis = setup_.axes[a];
    params_[spacings[a]] = axis.spacing;
  }
  params_["dt"] = setup_.step;
  params_["cells"] = static_cast<double>(global_cell_count(setup_.layout));
  draw_noise(0);
}

void Workspace::draw_noise(std::uint64_t interval) {
  for (const Noise& noise : setup_.noises) {
    Field& values = field(noise.name);
    if (setup_.count == nullptr) fill_noise(layout(), values.base(), noise.seed, interval);
  }
}

/// In a plan a field without memory, which is counted as long as it exists.
std::shared_ptr<Field> Workspace::make_field() {
  if (setup_.count == nullptr) return std::make_shared<Field>(layout(), fields_made_++);
  const auto bytes = static_cast<double>(bytes_of_field(layout()));
  setup_.count->hold(MemoryCount::of_fields, bytes);
  return {new Field(Field::without_memory(layout())), [count = setup_.count, bytes](Field* field) {
            count->hold(MemoryCount::of_fields, -bytes);
            delete field;
          }};
}

Field& Workspace::field(std::string_view name) {
  const auto found = fields_.find(name);
  if (found != fields_.end()) return *found->second;
  const std::shared_ptr<Field> shared = lent(name);
  return *fields_.emplace(name, shared ? shared : make_field()).first->second;
}

std::vector<Workspace::Axis>::const_iterator Workspace::axis_of(std::string_view name) const {
  return std::ranges::find(setup_.axes, name, &Axis::name);
}

std::shared_ptr<Field> Workspace::lent(std::string_view name) {
  const auto axis = axis_of(name);
  if (axis == setup_.axes.end()) return nullptr;
  std::weak_ptr<Field>& known = lent_[std::string(name)];
  std::shared_ptr<Field> field = known.lock();
  if (!field) {
    field = make_field();
    known = field;
    if (setup_.count != nullptr) return field;
    fill_coordinate(*field, static_cast<int>(axis - setup_.axes.begin()), axis->low, axis->spacing, axis->is_periodic);
  }
  return field;
}

void Workspace::release_coordinates() {
  if (std::exchange(has_released_coordinates_, true)) return;
  for (const Axis& axis : setup_.axes) release(axis.name);
}

Field& Workspace::field(std::string_view name, std::size_t number) {
  return number == 0 ? field(name) : field(fmt::format("{}@{}", name, number));
}

void Workspace::release(std::string_view name) {
  const auto found = fields_.find(name);
  if (found != fields_.end()) fields_.erase(found);
}

void Workspace::release(const dpde_program& program) {
  for (int f = program.input_count; f < program.field_count; ++f) release(program.fields[f]);
}

std::vector<BoundField> Workspace::bound_fields() {
  std::vector<BoundField> all;
  for (const auto& [name, field] : fields_) all.push_back({name, field->base(), field});
  for (const Axis& axis : setup_.axes) {
    if (fields_.contains(axis.name)) continue;
    const std::shared_ptr<Field> field = lent(axis.name);
    all.push_back({axis.name, field->base(), field});
  }
  return all;
}

const ControlField* Workspace::find_control_field(std::string_view name) const {
  const auto found = std::ranges::find(control_fields_, name, &ControlField::name);
  return found == control_fields_.end() ? nullptr : &*found;
}

void Workspace::add_control_field(std::string_view name, int every, std::size_t count) {
  if (find_control_field(name) != nullptr) return;
  ControlField& control = control_fields_.emplace_back(ControlField{std::string(name), every, {}});
  for (std::size_t k = 0; k < count; ++k) control.at.push_back(field(name, k).base());
}

void Workspace::make_like(std::string_view name, std::string_view like) {
  field(name);
  const ControlField* control = find_control_field(like);
  if (control != nullptr) add_control_field(name, control->every, control->at.size());
}

void Workspace::run_for_intervals(const dpde_program& program, std::string_view name) {
  const ControlField control = *find_control_field(name);
  for (std::size_t k = 0; k < control.at.size(); ++k) {
    draw_noise(k);
    const double middle = t_begin() + (static_cast<double>(k) + 0.5) * control.every * setup_.step;
    execute(program, middle, {{name, control.at[k]}});
  }
  draw_noise(0);
}

std::size_t Workspace::interval_at(double t, int every, std::size_t count) const {
  return control_interval(std::llround((t - t_begin()) / setup_.step), every, count);
}

std::vector<double> Workspace::dense(std::string_view name) {
  const ControlField* control = find_control_field(name);
  const std::size_t count = control == nullptr ? 1 : control->at.size();
  std::vector<double> values(count * cell_count_);
  for (std::size_t k = 0; k < count; ++k)
    field(name, k).copy_out(std::span(values).subspan(k * cell_count_, cell_count_));
  return values;
}

void Workspace::set_dense(std::string_view name, std::span<const double> values) {
  const ControlField* control = find_control_field(name);
  if (control == nullptr) return field(name).copy_in(values);
  for (std::size_t k = 0; k < control->at.size(); ++k)
    field(name, k).copy_in(values.subspan(k * cell_count_, cell_count_));
}

void Workspace::set_param(std::string_view name, double value) {
  const auto found = params_.find(name);
  if (found != params_.end()) {
    found->second = value;
  } else {
    params_.emplace(name, value);
  }
}

const Workspace::Control& Workspace::set_control(std::string_view name, int every, std::span<const double> values) {
  set_param(name, values.front());
  auto found = setup_.controls.find(name);
  if (found == setup_.controls.end()) found = setup_.controls.emplace(name, Control{}).first;
  Control& control = found->second;
  control.every = every;
  // In place: `values` may alias the stored vector, and spans of it must stay valid.
  if (control.values.size() != values.size()) control.values.resize(values.size());
  std::ranges::copy(values, control.values.begin());
  return control;
}

double Workspace::param_at(std::string_view name, double t) const {
  if (name == "t") return t;
  const auto control = setup_.controls.find(name);
  if (control != setup_.controls.end()) {
    const auto& [every, values] = control->second;
    return values[interval_at(t, every, values.size())];
  }
  const auto value = params_.find(name);
  return value == params_.end() ? 0 : value->second;  // a rate or a seed without a value
}

void Workspace::add_weights(const dpde_network& network, const double* given) {
  if (weights_.contains(std::string_view(network.name))) return;
  const auto count = static_cast<std::size_t>(network.weight_count);
  const std::vector<double> zero(count);
  weights_.try_emplace(
      network.name, Weights{given ? std::vector<double>(given, given + count) : initial_weights(network, network.seed),
                            zero, zero, zero});
}

namespace {

/// A missing link is an error, never a field of zeros. Exceptions: rates and seeds without a value, and states, which a
/// program may swap without reading them.
bool has_to_be_there(const dpde_program& program, int field) {
  const auto is_it = [&](const dpde_link& link) { return link.kind == DPDE_LINK_FIELD && link.derived == field; };
  const std::span swaps(program.swaps, static_cast<std::size_t>(program.swap_count));
  return field < program.input_count && std::ranges::none_of(links_of(program), is_it) &&
         std::ranges::find(swaps, field, &dpde_swap::state) == swaps.end();
}

}  // namespace

const Executor& Workspace::execute(const dpde_program& program, double t, const Bound& bound) {
  std::unique_ptr<Executor>& executor = executors_[&program];
  if (!executor) {
    executor = std::make_unique<Executor>(program, layout(), team(), solvers_, setup_.ranks);
    if (setup_.count != nullptr) setup_.count->hold(executor->memory());
  }
  for (int f = 0; f < program.field_count; ++f) {
    const std::string_view name = program.fields[f];
    const auto given = bound.find(name);
    if (given != bound.end()) {
      executor->bind(f, given->second);
      continue;
    }
    const ControlField* control = find_control_field(name);
    const auto is_known = [&] { return fields_.contains(name) || axis_of(name) != setup_.axes.end(); };
    if (control == nullptr && !is_known() && has_to_be_there(program, f))
      throw Error(ErrorKind::run, fmt::format("program {}: field {} is not bound", program.name, name));
    executor->bind(
        f, control != nullptr ? control->at[interval_at(t, control->every, control->at.size())] : field(name).base());
  }
  if (setup_.count != nullptr) return *executor;
  for (int p = 0; p < program.param_count; ++p) executor->set_param(p, param_at(program.params[p], t));
  for (int n = 0; n < program.network_count; ++n) {
    Weights& weights = weights_.find(std::string_view(program.networks[n]->name))->second;
    std::ranges::fill(weights.bars, 0.0);
    std::ranges::fill(weights.rate_bars, 0.0);
    executor->bind_weights(n, weights.bound());
  }
  executor->update_weights();
  executor->update_uniforms();
  executor->prepare();
  executor->run();
  return *executor;
}

std::map<std::string, double> Workspace::run(const dpde_program& program, double t, const Bound& bound) {
  const Executor& executor = execute(program, t, bound);
  std::map<std::string, double> sums;
  for (int s = 0; s < program.sum_count; ++s) sums[program.sums[s]] = executor.sums()[static_cast<std::size_t>(s)];
  return sums;
}

}  // namespace dpde
