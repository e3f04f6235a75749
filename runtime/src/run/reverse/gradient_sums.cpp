// SPDX-License-Identifier: Apache-2.0
#include "run/reverse/gradient_sums.h"

#include <fmt/format.h>

#include <algorithm>

#include "dpde/runtime/error.h"

namespace dpde {

GradientSums::GradientSums(const ResolvedSetup& setup, GradientResult& result)
    : setup_(setup), result_(result), layout_(setup.layout) {
  layout_.real = DPDE_F64;
  for (const ControlField& control : setup.control_fields) {
    if (control.every < 1 || control.at.empty())
      throw Error(ErrorKind::input,
                  fmt::format("control field {} needs intervals of at least one step, and fields", control.name));
  }
  size_t next = 0;
  for (size_t i = 0; i < setup.sought.size(); ++i) {
    SoughtField& field = sought_.emplace_back(SoughtField{next});
    if (const int number = setup.control_fields_at()[setup.sought_id(i)]; number >= 0) {
      const ControlField& control = setup.control_fields[static_cast<size_t>(number)];
      field = {next, control.at.size(), control.every};
    }
    next += field.count;
  }
}

std::vector<ParamBar> GradientSums::bind_params(const dpde_program& adjoint) {
  std::vector<ParamBar> found;
  for (const ProgramIds::Link& link : setup_.ids(adjoint).links) {
    if (link.kind != DPDE_LINK_PARAM || link.derived < 0) continue;
    auto place = std::ranges::find(params_, link.primal);
    if (place == params_.end()) {
      param_names_.push_back(setup_.values().name(link.primal));
      place = params_.insert(place, link.primal);
    }
    found.push_back({static_cast<size_t>(link.derived), static_cast<size_t>(place - params_.begin())});
  }
  return found;
}

/// Their memory is among the temporaries of the program.
std::vector<FieldBar> GradientSums::bind_fields(const dpde_program& adjoint) const {
  std::vector<FieldBar> found;
  for (size_t i = 0; i < setup_.sought.size(); ++i) {
    const int field = setup_.ids(adjoint).derived(DPDE_LINK_FIELD, setup_.sought_id(i));
    if (field >= adjoint.input_count) found.push_back({field, i});
  }
  return found;
}

void GradientSums::bind_weights(Executor& executor, bool adds) {
  const dpde_program& program = executor.program();
  for (int i = 0; i < program.network_count; ++i) {
    const dpde_network& network = *program.networks[i];
    const ValueId id = setup_.ids(program).networks[static_cast<size_t>(i)];
    const int number = setup_.weights_at()[id];
    const BoundWeights* const given = number < 0 ? nullptr : &setup_.weights[static_cast<size_t>(number)];
    if (given == nullptr || (given->values == nullptr && network.weight_count > 0))
      throw_not_bound(program, "network", network.name);
    auto bars = std::ranges::find(weights_, id, &WeightBars::network);
    if (given->learned && bars == weights_.end()) {
      const std::vector<double> zero(static_cast<size_t>(network.weight_count));
      bars = weights_.insert(bars, {id, zero, zero});
    }
    const bool is_added_to = given->learned && adds;
    executor.bind_weights(i, {given->values, given->rates, is_added_to ? bars->values.data() : nullptr,
                              is_added_to ? bars->rates.data() : nullptr, given->host});
  }
}

void GradientSums::allocate(RunMemory& memory) {
  const int64_t count = sought_.empty() ? 0 : static_cast<int64_t>(sought_.back().first + sought_.back().count);
  pool_ = memory.pool(layout_, count);
  if (memory.is_plan()) return;
  for (int64_t i = 0; i < count; ++i) result_.field_bars.push_back({&layout_, pool_.base(i)});
}

void GradientSums::size_params() {
  result_.param_bars.assign(params_.size(), 0.0);
  result_.control_bars.resize(params_.size());
  control_every_.assign(params_.size(), 1);
}

void GradientSums::set_control(ValueId id, int every, size_t intervals) {
  const auto place = std::ranges::find(params_, id);
  if (place == params_.end()) return;
  const auto number = static_cast<size_t>(place - params_.begin());
  result_.control_bars[number].resize(intervals);
  control_every_[number] = every;
}

void GradientSums::begin() {
  std::ranges::fill(result_.param_bars, 0.0);
  for (WeightBars& of_network : weights_) {
    std::ranges::fill(of_network.values, 0.0);
    std::ranges::fill(of_network.rates, 0.0);
  }
  for (std::vector<double>& of_control : result_.control_bars) std::ranges::fill(of_control, 0.0);
  for (size_t i = 0; i < result_.field_bars.size(); ++i) fill_all(layout_, pool_.base(static_cast<int64_t>(i)), 0.0);
}

void GradientSums::add_params(std::span<const double> sums, const std::vector<ParamBar>& params, int n) {
  for (const ParamBar& param : params) {
    std::vector<double>& of_control = result_.control_bars[param.param];
    if (of_control.empty()) {
      result_.param_bars[param.param] += sums[param.sum];
    } else {
      of_control[control_interval(n, control_every_[param.param], of_control.size())] += sums[param.sum];
    }
  }
}

void GradientSums::add_fields(const Executor& executor, const std::vector<FieldBar>& fields, int n) {
  for (const FieldBar& of : fields)
    add_interior(layout_, field(of.number, n), {&setup_.layout, executor.bound(of.field)}, setup_.team);
}

const GradientSums::SoughtField* GradientSums::find_sought(ValueId field) const {
  const int number = setup_.sought_at()[field];
  return number < 0 ? nullptr : &sought_[static_cast<size_t>(number)];
}

const GradientSums::WeightBars* GradientSums::find_weights(ValueId network) const {
  const auto found = std::ranges::find(weights_, network, &WeightBars::network);
  return found == weights_.end() ? nullptr : &*found;
}

FieldView GradientSums::field_bar(ValueId field) const {
  const SoughtField* const found = find_sought(field);
  return found == nullptr ? FieldView{} : result_.field_bars[found->first];
}

bool GradientSums::copy_field_bar(ValueId field, std::span<double> to) const {
  const SoughtField* const of = find_sought(field);
  if (of == nullptr) return false;
  const size_t size = to.size() / of->count;
  for (size_t i = 0; i < of->count; ++i) copy_out(result_.field_bars[of->first + i], to.subspan(i * size, size));
  return true;
}

void GradientSums::copy_param_bar(ValueId param, std::span<double> to) const {
  std::ranges::fill(to, 0.0);
  if (const WeightBars* const network = find_weights(param)) {
    std::ranges::copy(network->values, to.begin());
    return;
  }
  const auto found = std::ranges::find(params_, param);
  if (found == params_.end()) return;
  const auto number = static_cast<size_t>(found - params_.begin());
  const std::vector<double>& of_control = result_.control_bars[number];
  if (of_control.empty()) {
    to[0] = result_.param_bars[number];
  } else {
    std::ranges::copy(of_control, to.begin());
  }
}

void GradientSums::copy_rate_bar(ValueId network, std::span<double> to) const {
  std::ranges::fill(to, 0.0);
  if (const WeightBars* const bars = find_weights(network)) std::ranges::copy(bars->rates, to.begin());
}

}  // namespace dpde
