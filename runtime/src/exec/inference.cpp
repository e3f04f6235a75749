// SPDX-License-Identifier: Apache-2.0
#include "exec/inference.h"

#include <algorithm>

namespace dpde {

Inference::Inference(const dpde_inference& source, const dpde_network& network)
    : network_(static_cast<std::size_t>(source.network)), mode_(source.mode), weights_(source.weights != 0) {
  const bool is_adjoint = mode_ == DPDE_NETWORK_ADJOINT, is_second = mode_ == DPDE_NETWORK_SECOND;
  const auto list = [](const int32_t* fields, int32_t count) {
    return List{{fields, fields + count}, std::vector<void*>(static_cast<std::size_t>(count))};
  };
  inputs_ = list(source.inputs, network.inputs);
  const int32_t inputs = network.inputs, outputs = network.outputs;
  if (mode_ != DPDE_NETWORK_VALUE)
    rates_ = list(source.rates, is_second ? inputs + outputs : is_adjoint ? outputs : inputs);
  results_ = list(source.results, is_second ? 2 * inputs : is_adjoint ? inputs : outputs);
}

void* const* Inference::List::bound(void* const* to) {
  for (std::size_t i = 0; i < fields.size(); ++i) bases[i] = fields[i] < 0 ? nullptr : to[fields[i]];
  return bases.data();
}

void Inference::run(Network& network, void* const* fields, const dpde_weights& weights) {
  void* const* inputs = inputs_.bound(fields);
  void* const* rates = rates_.bound(fields);
  void* const* results = results_.bound(fields);
  switch (mode_) {
    case DPDE_NETWORK_VALUE: return network.value(inputs, results);
    case DPDE_NETWORK_TANGENT: return network.tangent(inputs, rates, weights_ ? weights.rates : nullptr, results);
    case DPDE_NETWORK_ADJOINT: return network.adjoint(inputs, rates, results, weights_ ? weights.bars : nullptr);
    default: {
      const std::size_t count = inputs_.fields.size();
      NetworkSecond second{inputs, rates, rates + count, results, results + count};
      if (weights_) {
        second.weight_rates = weights.rates;
        second.weight_bars = weights.bars;
        second.weight_rate_bars = weights.rate_bars;
      }
      return network.second(second);
    }
  }
}

void Inference::run_beside_tapes(Network& network, void* const* fields) {
  network.value_beside_tapes(inputs_.bound(fields), results_.bound(fields));
}

namespace {

std::int64_t count_applications(const dpde_operation* operations, int32_t count, int network, int mode) {
  std::int64_t total = 0;
  for (int32_t i = 0; i < count; ++i) {
    const dpde_operation& o = operations[i];
    total += o.kind == DPDE_NETWORK && o.inference.network == network && o.inference.mode == mode;
    if (o.kind == DPDE_REPEAT)
      total += o.repeat.count * count_applications(o.repeat.operations, o.repeat.operation_count, network, mode);
  }
  return total;
}

}  // namespace

std::int64_t applications(const dpde_program& program, int network, int mode) {
  return count_applications(program.operations, program.operation_count, network, mode);
}

}  // namespace dpde
