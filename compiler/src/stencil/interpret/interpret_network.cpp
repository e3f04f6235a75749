// SPDX-License-Identifier: Apache-2.0
// Statements that apply networks, by the reference evaluation of networks.
#include <span>

#include "network/evaluate.h"
#include "stencil/interpret/interpret.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

/// A tensor with one channel per field; the field "" is 0.
network::Tensor tensor_of(const State& state, const std::vector<std::string>& fields) {
  network::Tensor tensor{static_cast<int>(fields.size()), state.grid().cells, {}};
  for (const std::string& field : fields) {
    for_each_cell({}, tensor.cells,
                  [&](const CellIndex& cell) { tensor.values.push_back(field.empty() ? 0.0 : state.at(field, cell)); });
  }
  return tensor;
}

/// Applies a network that the host computes.
network::Tensor apply_host(const State& state, const NetworkCall& network_call, const network::Network& network,
                           const network::Tensor& inputs, Weights& weights) {
  const bool has_rates =
      network_call.mode == NetworkCall::Mode::tangent || network_call.mode == NetworkCall::Mode::second;
  require(!has_rates && weights.host_value, "a network of the host's, and not its rates");
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

/// Stores each channel in a field; the channel of "" is dropped.
void store(State& state, std::span<const std::string> fields, const network::Tensor& from) {
  auto next = from.values.begin();
  for (const std::string& field : fields) {
    if (!field.empty() && !state.has(field)) state.poison(field);
    for_each_cell({}, state.grid().cells, [&](const CellIndex& cell) {
      const double value = *next++;
      if (!field.empty()) state.at(field, cell) = state.stored(value);
    });
  }
}

void add(std::vector<double>& to, const std::vector<double>& more) {
  to.resize(more.size());
  for (std::size_t i = 0; i < more.size(); ++i) to[i] += more[i];
}

network::Tensor tangent_of(const State& state, const NetworkCall& call, const network::Network& network,
                           const network::Tensor& inputs, const Weights& weights) {
  const network::Weights all{weights.values, call.weights ? weights.rates : std::vector<double>{}};
  return network::tangent(network, inputs, tensor_of(state, call.rates), all);
}

network::Tensor adjoint_of(const State& state, const NetworkCall& call, const network::Network& network,
                           const network::Tensor& inputs, Weights& weights) {
  std::vector<double> bars(weights.values.size());
  network::Tensor result = network::adjoint(network, inputs, tensor_of(state, call.rates), weights.values, bars);
  if (call.weights) add(weights.bars, bars);
  return result;
}

void apply_second(State& state, const NetworkCall& call, const network::Network& network, const network::Tensor& inputs,
                  Weights& weights) {
  const auto split = call.rates.begin() + network.inputs;
  const network::Tensor rates = tensor_of(state, {call.rates.begin(), split}),
                        seeds = tensor_of(state, {split, call.rates.end()});
  const network::SecondBars bars = network::second(
      network, inputs, rates, seeds, {weights.values, call.weights ? weights.rates : std::vector<double>{}});
  const std::span<const std::string> results(call.results);
  store(state, results.first(call.inputs.size()), bars.inputs);
  store(state, results.subspan(call.inputs.size()), bars.input_rates);
  if (!call.weights) return;
  add(weights.bars, bars.weights);
  add(weights.rate_bars, bars.weight_rates);
}

}  // namespace

void apply(State& state, const NetworkCall& network_call, const network::Network& network) {
  Weights& weights = state.weights[network_call.network];
  const network::Tensor inputs = tensor_of(state, network_call.inputs);
  if (network.is_host())
    return store(state, network_call.results, apply_host(state, network_call, network, inputs, weights));
  switch (network_call.mode) {
    case NetworkCall::Mode::value:
      return store(state, network_call.results, network::value(network, inputs, weights.values));
    case NetworkCall::Mode::tangent:
      return store(state, network_call.results, tangent_of(state, network_call, network, inputs, weights));
    case NetworkCall::Mode::adjoint:
      return store(state, network_call.results, adjoint_of(state, network_call, network, inputs, weights));
    case NetworkCall::Mode::second: return apply_second(state, network_call, network, inputs, weights);
  }
}

}  // namespace dpde::stencil
