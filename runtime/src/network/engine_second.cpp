// SPDX-License-Identifier: Apache-2.0
// Reverse mode of a run of rates. Replace each value x by the dual number x + e*x_dot, e*e = 0. The adjoint of the run
// then has two parts. Seeded with the adjoints of the outputs' rates, the part without e is the adjoint of the rates,
// the part with e the adjoint of the values. So each step is reversed twice; in between, the contribution of its own
// rate is added to the second part. The parts lie in two banks of memory.
#include <algorithm>

#include "network/engine.h"
#include "network/engine_rows.h"
#include "network/layers.h"

namespace dpde::nn {

template <class Real>
void Engine<Real>::prepare_second() {
  if (second_memory_) return;
  own_rates_.resize(plan_.values.size());
  other_roots_.resize(plan_.values.size());
  other_written_.resize(plan_.values.size());
  reverse_rates_.resize(plan_.steps.size());
  lay_out_second(false);
  second_bytes_ = used_;
  second_memory_ = Buffer(second_bytes_);
  lay_out_second(true);
}

/// Called twice, as lay_out().
template <class Real>
void Engine<Real>::lay_out_second(bool place) {
  char* const memory = place ? second_memory_.data() : nullptr;
  used_ = 0;
  for (size_t v = 0; v < plan_.values.size(); ++v) {
    const Value& value = plan_.values[v];
    if (v > 0 && !plan_.steps[v - 1].live) continue;
    own_rates_[v] = take(memory, value.shape.size);
    if (value.root == static_cast<int32_t>(v)) other_roots_[v] = take(memory, value.adjoint.size);
  }
  for (size_t k = 0; k < plan_.steps.size(); ++k) {
    const Convolution& convolution = plan_.steps[k].convolution;
    reverse_rates_[k].resize(convolution.reverse.size());
    for (size_t phase = 0; phase < convolution.reverse.size(); ++phase)
      reverse_rates_[k][phase] = take(memory, static_cast<int64_t>(convolution.reverse[phase].weights.size()));
  }
}

/// Swaps the adjoints and the rates of the adjoints.
template <class Real>
void Engine<Real>::exchange_banks() {
  roots_.swap(other_roots_);
  written_.swap(other_written_);
}

template <class Real>
void Engine<Real>::find_rates(const Ports& ports, const NetworkSecond& call) {
  load(ports, call.input_rates, rate_view(0));
  finish(0, rate_view(0));
  for (size_t k = 0; k < plan_.steps.size(); ++k) {
    if (!plan_.steps[k].live) continue;
    rate_step(k, call.weight_rates);
    const Convolution& convolution = plan_.steps[k].convolution;
    for (size_t phase = 0; phase < convolution.reverse.size() && call.weight_rates != nullptr; ++phase)
      pack(convolution.reverse[phase], call.weight_rates, reverse_rates_[k][phase]);
  }
}

template <class Real>
void Engine<Real>::second(const Ports& ports, const NetworkSecond& call) {
  now_ = memory_.data();
  load(ports, call.inputs, value_view(0));
  run(true);
  has_own_rates_ = true;
  find_rates(ports, call);
  begin_reverse();
  const bool has_weights = call.weight_bars != nullptr || call.weight_rate_bars != nullptr;
  find_needs(call.input_bars, has_weights);
  const bool is_input_needed = needed_[0] != 0;
  find_needs(call.input_rate_bars, has_weights);
  if (is_input_needed) find_needs(call.input_bars, has_weights);
  const size_t last = plan_.values.size() - 1;
  load(ports, call.seeds, adjoint_view(last));
  std::fill(written_.begin(), written_.end(), 0);
  std::fill(other_written_.begin(), other_written_.end(), 0);
  written_[last] = 1;
  for (size_t k = plan_.steps.size(); k-- > 0;) {
    if (plan_.steps[k].live && needed_[k + 1] && written_[k + 1]) second_step(k, call);
  }
  has_own_rates_ = false;
  const auto give = [&](void* const* bars) {
    if (bars == nullptr || !needed_[0]) return;
    if (!written_[0]) clear_cells(team_, adjoint_view(0));
    store(ports, adjoint_view(0), bars);
  };
  give(call.input_rate_bars);
  exchange_banks();
  give(call.input_bars);
  exchange_banks();
}

/// Linear layers without weights reverse both parts in the same way.
template <class Real>
void Engine<Real>::second_step(size_t k, const NetworkSecond& call) {
  const dpde_layer& layer = plan_.steps[k].layer;
  if (layer.kind == DPDE_CONV) return second_convolution(k, call);
  if (layer.kind == DPDE_ACTIVATE) return second_activation(k);
  exchange_banks();
  if (written_[k + 1]) adjoint_step(k, nullptr);
  exchange_banks();
  adjoint_step(k, nullptr);
}

/// Reverse of (w + e*w_dot) * (x + e*x_dot).
template <class Real>
void Engine<Real>::second_convolution(size_t k, const NetworkSecond& call) {
  const Step& step = plan_.steps[k];
  const auto input = static_cast<size_t>(step.layer.input);
  const View<Real> seeds = adjoint_view(k + 1);
  clear_margins(seeds);
  exchange_banks();
  const View<Real> rates = adjoint_view(k + 1);
  const bool has_rates = written_[k + 1] != 0;
  if (has_rates) clear_margins(rates);
  const auto add = [&](const View<Real>& source, const View<Real>& from, bool bias, double* bars) {
    if (bars == nullptr) return;
    add_weight_gradient(team_, step.convolution.forward, source, from, bars + step.layer.weights);
    if (bias && step.layer.bias >= 0) add_bias_gradient(step, from, bars);
  };
  const View<Real> values = read_by(step, value_view(input));
  add(values, seeds, true, call.weight_rate_bars);
  if (has_rates) add(values, rates, true, call.weight_bars);
  add(read_by(step, rate_view(input)), seeds, false, call.weight_bars);
  if (has_rates) adjoint_of_input(k, rates, packed_[k].reverse);
  if (call.weight_rates != nullptr) adjoint_of_input(k, seeds, reverse_rates_[k]);
  exchange_banks();
  adjoint_of_input(k, seeds, packed_[k].reverse);
}

/// Reverse of f'(z + e*z_dot). Uses the seeds before adjoint_activation multiplies them in place.
template <class Real>
void Engine<Real>::second_activation(size_t k) {
  const dpde_layer& layer = plan_.steps[k].layer;
  const auto input = static_cast<size_t>(layer.input);
  if (!needed_[input]) return;
  const View<Real> seeds = adjoint_view(k + 1), rates = rate_view(input);
  exchange_banks();
  if (written_[k + 1]) adjoint_activation(k);
  if (layer.activation != DPDE_RELU && layer.activation != DPDE_LEAKY_RELU) {
    const View<Real> bars = added_to(input);
    const bool of_result = !plan_.values[input].kept;
    const View<Real> at = value_view(of_result ? k + 1 : input);
    const auto bend = of_result ? kernels_.bend_of_result : kernels_.bend;
    for_each_row_of(team_, *at.shape, 4, [&](int64_t channel, int64_t row) {
      bend(layer.activation, at.row(channel, row), rates.row(channel, row), seeds.row(channel, row),
           bars.row(channel, row), at.shape->cells[0]);
    });
  }
  exchange_banks();
  adjoint_activation(k);
}

template class Engine<float>;
template class Engine<double>;

}  // namespace dpde::nn
