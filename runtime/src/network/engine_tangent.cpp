// SPDX-License-Identifier: Apache-2.0
// Forward mode: values and their rates, step by step.
#include <algorithm>

#include "network/engine.h"
#include "network/engine_rows.h"
#include "network/layers.h"

namespace dpde::nn {

template <class Real>
void Engine<Real>::tangent(const Ports& ports, void* const* inputs, void* const* input_rates,
                           const double* weight_rates, void* const* output_rates) {
  now_ = memory_.data();
  load(ports, inputs, value_view(0));
  run(true);
  load(ports, input_rates, rate_view(0));
  finish(0, rate_view(0));
  for (size_t k = 0; k < plan_.steps.size(); ++k) {
    if (plan_.steps[k].live) rate_step(k, weight_rates);
  }
  store(ports, rate_view(plan_.values.size() - 1), output_rates);
}

template <class Real>
void Engine<Real>::rate_step(size_t k, const double* weight_rates) {
  const Step& step = plan_.steps[k];
  const dpde_layer& layer = step.layer;
  const auto input = static_cast<size_t>(layer.input);
  const View<Real> rates = rate_view(input), result = rate_view(k + 1);
  switch (layer.kind) {
    case DPDE_CONV: rate_convolution(k, weight_rates); break;
    case DPDE_ACTIVATE: {
      const bool of_result = !plan_.values[input].kept;
      const View<Real> at = value_view(of_result ? k + 1 : input);
      const auto rate = of_result ? kernels_.rate_of_result : kernels_.activation_rate;
      for_each_row_of(team_, *at.shape, 4, [&](int64_t channel, int64_t row) {
        rate(layer.activation, static_cast<Real>(layer.factor), at.row(channel, row), rates.row(channel, row),
             result.row(channel, row), false, at.shape->cells[0]);
      });
      break;
    }
    case DPDE_MAX_POOL: max_pool(team_, layer.stride, value_view(input), rates, result); break;
    case DPDE_FIX_SUM: fix_sum(team_, Real(0), rates, result, false); break;
    case DPDE_ADD:
      if (step.merged >= 0 && !has_own_rates_) {
        const View<Real> other = rate_view(static_cast<size_t>(layer.input == step.merged ? layer.other : layer.input));
        for_each_row_of(team_, *other.shape, 1, [&](int64_t channel, int64_t row) {
          kernels_.scale(1, other.row(channel, row), result.row(channel, row), true, other.shape->cells[0]);
        });
        break;
      }
      [[fallthrough]];
    default: run_layer(step, rates, joins(step) ? rate_view(static_cast<size_t>(layer.other)) : View<Real>{}, result);
  }
  finish(k + 1, result);
}

/// Product rule: rates with the weights, then values with the rates of the weights.
template <class Real>
void Engine<Real>::rate_convolution(size_t k, const double* weight_rates) {
  const Step& step = plan_.steps[k];
  const auto input = static_cast<size_t>(step.layer.input);
  const Product& product = step.convolution.forward;
  const Range range = whole(plan_.values[k + 1]);
  const Target<Real> target{rate_view(k + 1)};
  convolve(team_, product, packed_[k].forward, read_by(step, rate_view(input)), target, range, {});
  if (weight_rates == nullptr) return;
  pack(product, weight_rates, packed_[k].rates);
  Ends<Real> ends;
  ends.base = target.result;
  if (step.layer.bias >= 0) {
    std::transform(weight_rates + step.layer.bias, weight_rates + step.layer.bias + step.layer.channels,
                   packed_[k].bias_rates, [](double value) { return static_cast<Real>(value); });
    ends.bias = packed_[k].bias_rates;
  }
  convolve(team_, product, packed_[k].rates, read_by(step, value_view(input)), target, range, ends);
}

template class Engine<float>;
template class Engine<double>;

}  // namespace dpde::nn
