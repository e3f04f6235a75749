// SPDX-License-Identifier: Apache-2.0
// Reference evaluation of networks: every layer as a list of terms, in double precision; slow and simple.
#pragma once

#include <array>
#include <vector>

#include "network/network.h"

namespace dpde::network {

/// One value of a network with all channels: channel after channel, x fastest.
struct Tensor {
  int channels = 0;
  std::array<int, 3> cells{1, 1, 1};
  std::vector<double> values;
};

/// Weights and their tangents; empty tangents are 0.
struct Weights {
  std::vector<double> values, rates;
};

/// The outputs for inputs of network.inputs channels on the grid.
Tensor value(const Network& network, const Tensor& inputs, const std::vector<double>& weights);
/// Tangents of the outputs, for tangents of the inputs and weights.
Tensor tangent(const Network& network, const Tensor& inputs, const Tensor& rates, const Weights& weights);
/// Transposed Jacobian times `seed`: returned for the inputs, and added to `weight_bars` for the weights.
Tensor adjoint(const Network& network, const Tensor& inputs, const Tensor& seed, const std::vector<double>& weights,
               std::vector<double>& weight_bars);

/// Adjoints of inputs and weights, and of the tangents of both.
struct SecondBars {
  Tensor inputs, input_rates;
  std::vector<double> weights, weight_rates;
};
/// The adjoint of tangent(): transposed Jacobian times `seed`, the adjoint of the output tangents.
SecondBars second(const Network& network, const Tensor& inputs, const Tensor& rates, const Tensor& seed,
                  const Weights& weights);

}  // namespace dpde::network
