// SPDX-License-Identifier: Apache-2.0
// The reference meaning of networks: every layer as a list of terms, in doubles, slow and obvious.
#pragma once

#include <array>
#include <vector>

#include "network/network.h"

namespace dpde::network {

/// Values of all channels of one value of a network: channel after channel, x fastest.
struct Tensor {
  int channels = 0;
  std::array<int, 3> cells{1, 1, 1};
  std::vector<double> values;
};

/// What the weights are multiplied with; a rate of weights that is empty is 0.
struct Weights {
  std::vector<double> values, rates;
};

/// The outputs for inputs of network.inputs channels on the grid.
Tensor value(const Network& network, const Tensor& inputs, const std::vector<double>& weights);
/// Their rates for rates of the inputs and of the weights.
Tensor tangent(const Network& network, const Tensor& inputs, const Tensor& rates, const Weights& weights);
/// The transpose of the derivative times `seed`: by the inputs, and added to `weight_bars` by the weights.
Tensor adjoint(const Network& network, const Tensor& inputs, const Tensor& seed, const std::vector<double>& weights,
               std::vector<double>& weight_bars);

/// Adjoints of inputs and weights, and of the rates of both.
struct SecondBars {
  Tensor inputs, input_rates;
  std::vector<double> weights, weight_rates;
};
/// The adjoint of tangent(): its transpose times `seed`, of the outputs' rates.
SecondBars second(const Network& network, const Tensor& inputs, const Tensor& rates, const Tensor& seed,
                  const Weights& weights);

}  // namespace dpde::network
