// SPDX-License-Identifier: Apache-2.0
// Statements that apply networks, by the reference evaluation of these.
#include "network/evaluate.h"
#include "stencil/interpret.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

/// One channel a field; "" is 0.
network::Tensor tensor_of(const State& state, const std::vector<std::string>& fields) {
  network::Tensor tensor{static_cast<int>(fields.size()), state.grid().cells, {}};
  for (const std::string& field : fields) {
    for_each_cell({}, tensor.cells,
                  [&](const Cell& cell) { tensor.values.push_back(field.empty() ? 0.0 : state.at(field, cell)); });
  }
  return tensor;
}

/// Of a network that the host computes.
network::Tensor apply_host(const State& state, const NetworkCall& network_call, const network::Network& network,
                           const network::Tensor& inputs, Weights& weights) {
  require(network_call.mode != NetworkCall::Mode::tangent && weights.host_value,
          "a network of the host's, and not its rates");
  network::Tensor result{network.outputs, inputs.cells, {}};
  if (network_call.mode == NetworkCall::Mode::value) {
    result.values.resize(inputs.values.size() / network_call.inputs.size() * network_call.results.size());
    weights.host_value(inputs.values.data(), weights.values.data(), result.values.data());
    return result;
  }
  std::vector<double> bars(weights.values.size());
  result.values.resize(inputs.values.size());
  weights.host_vector_jacobian(inputs.values.data(), weights.values.data(),
                               tensor_of(state, network_call.rates).values.data(), result.values.data(), bars.data());
  weights.bars.resize(bars.size());
  for (std::size_t i = 0; network_call.weights && i < bars.size(); ++i) weights.bars[i] += bars[i];
  return result;
}

}  // namespace

void apply(State& state, const NetworkCall& network_call, const network::Network& network) {
  Weights& weights = state.weights[network_call.network];
  const network::Tensor inputs = tensor_of(state, network_call.inputs);
  network::Tensor result;
  if (network.is_host()) {
    result = apply_host(state, network_call, network, inputs, weights);
  } else if (network_call.mode == NetworkCall::Mode::value) {
    result = network::value(network, inputs, weights.values);
  } else if (network_call.mode == NetworkCall::Mode::tangent) {
    const network::Weights all{weights.values, network_call.weights ? weights.rates : std::vector<double>{}};
    result = network::tangent(network, inputs, tensor_of(state, network_call.rates), all);
  } else {
    std::vector<double> bars = weights.bars;
    bars.resize(weights.values.size());
    result = network::adjoint(network, inputs, tensor_of(state, network_call.rates), weights.values, bars);
    if (network_call.weights) weights.bars = bars;
  }
  auto next = result.values.begin();
  for (const std::string& field : network_call.results) {
    if (!field.empty() && !state.has(field)) state.poison(field);
    for_each_cell({}, state.grid().cells, [&](const Cell& cell) {
      const double value = *next++;
      if (!field.empty()) state.at(field, cell) = state.stored(value);
    });
  }
}

}  // namespace dpde::stencil
