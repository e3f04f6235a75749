// SPDX-License-Identifier: Apache-2.0
#include "inference.h"

#include <algorithm>

namespace dpde {

Inference::Inference(const dpde_inference& source, const dpde_network& network)
    : network_(static_cast<std::size_t>(source.network)), mode_(source.mode), weights_(source.weights != 0) {
  const bool is_adjoint = mode_ == DPDE_NETWORK_ADJOINT;
  const auto list = [](const int32_t* fields, int32_t count) {
    return List{{fields, fields + count}, std::vector<void*>(static_cast<std::size_t>(count))};
  };
  inputs_ = list(source.inputs, network.inputs);
  if (mode_ != DPDE_NETWORK_VALUE) rates_ = list(source.rates, is_adjoint ? network.outputs : network.inputs);
  results_ = list(source.results, is_adjoint ? network.inputs : network.outputs);
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
    default: return network.adjoint(inputs, rates, results, weights_ ? weights.bars : nullptr);
  }
}

std::int64_t applications(const dpde_program& program, int network, int mode) {
  return std::count_if(program.operations, program.operations + program.operation_count,
                       [&](const dpde_operation& operation) {
                         return operation.kind == DPDE_NETWORK && operation.inference.network == network &&
                                operation.inference.mode == mode;
                       });
}

}  // namespace dpde
