// SPDX-License-Identifier: Apache-2.0
// A neural network on the cells of a grid: layers in static single assignment form. The model level creates it, lower
// levels pass it on unchanged, and the runtime evaluates it (dpde/network_abi.h defines the layers).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "support/vocabulary.h"

namespace dpde::network {

enum class LayerKind { conv, activate, scale, add, concat, mean_pool, max_pool, upsample, fix_sum, reorient };
enum class Activation { relu, leaky_relu, gelu, tanh, sigmoid, softplus, silu };
/// Padding of convolutions beyond the ends of an axis.
enum class Padding { periodic, zero, replicate, reflect };
/// Initialisation of a convolution's weights.
enum class Init { he, xavier, zero };

/// Value 0 is the network's input, value k the result of layers[k-1]; the last one is the output.
struct Layer {
  LayerKind kind = LayerKind::conv;
  int input = 0;
  int other = -1;    // second input of add and concat
  int channels = 1;  // of the result
  int extent = 1;    // of conv: kernel size along each axis, odd
  int stride = 1;    // of conv, pools and upsample
  int dilation = 1, groups = 1;
  bool bias = true;
  Init init = Init::he;
  double gain = 1;
  Activation activation = Activation::relu;
  int weights_of = 0;  // of conv: value of the layer whose weights it shares; 0: it has its own
  // of reorient, counted from 1, negative for reversed: input axis of each axis of the result; and input channel of
  // each channel of the result (negative: times -1). Empty: unchanged.
  std::array<int, 3> axes{1, 2, 3};
  std::vector<int> order = {};
  double factor = 0;  // of scale, fix_sum (the sum), leaky_relu (slope below 0)
  bool operator==(const Layer&) const = default;
};

struct Network {
  std::string name;
  int inputs = 1, outputs = 1;   // channels
  std::vector<Padding> padding;  // one for each axis
  std::vector<Layer> layers;
  std::uint64_t seed = 0;
  Precision real = Precision::f32;
  std::int64_t host_weights = -1;  // >= 0: a host function with so many weights, instead of layers
  bool is_host() const { return host_weights >= 0; }
  int rank() const { return static_cast<int>(padding.size()); }
  bool operator==(const Network&) const = default;
};

/// A network or its derivative applied to fields: a statement of programs (defined in stencil/stencil.h). "" denotes a
/// tangent that is 0 or a result that is not needed.
struct NetworkCall {
  enum class Mode { value, tangent, adjoint, second };  // second: the adjoint of the tangent
  std::string network;
  Mode mode = Mode::value;
  std::vector<std::string> inputs;   // one for each channel
  std::vector<std::string> rates;    // tangents of the inputs; for adjoint: adjoints of the outputs; for second: both
  std::vector<std::string> results;  // outputs, their tangents, or input adjoints; for second also tangent adjoints
  bool weights = false;
  bool operator==(const NetworkCall&) const = default;
};
/// Number of rates and results in a mode.
std::size_t rate_count(const Network& network, NetworkCall::Mode mode);
std::size_t result_count(const Network& network, NetworkCall::Mode mode);
/// Whether it adds to the adjoints of the weights, if these are included.
bool adds_to_weights(NetworkCall::Mode mode);
/// Fields read and written, in order, without absent ones.
std::vector<std::string> fields_read(const NetworkCall& network_call);
std::vector<std::string> fields_written(const NetworkCall& network_call);
/// adjoint corrector(a, b) by c_bar, _ to a_bar, b_bar weights
std::string text_of(const NetworkCall& network_call);

/// Channels of value `number`.
int channels_of(const Network& network, int number);
/// Index of the first weight of layer `index` (a conv), and of its bias; -1 if it has none.
std::int64_t weights_begin(const Network& network, int index);
std::int64_t bias_begin(const Network& network, int index);
std::int64_t weight_count(const Network& network);
/// Multiplications by weights, for each cell of the scene's grid.
double multiplications_a_cell(const Network& network);
/// Whether the network is a function of the values in one cell: no convolution reads neighbours and no layer changes
/// the grid.
bool is_pointwise(const Network& network);

std::string_view name_of(Activation activation);  // "leaky_relu"
std::string_view name_of(Padding padding);
std::string_view name_of(Init init);

}  // namespace dpde::network
