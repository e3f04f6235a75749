// SPDX-License-Identifier: Apache-2.0
// A neural network over the cells of a grid: layers in static single assignment. The model level makes it out of what
// the file says, every level below carries it as it is, and the runtime runs it (dpde/network_abi.h says what layers
// compute).
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
/// What a convolution finds beyond the ends of an axis.
enum class Padding { periodic, zero, replicate, reflect };
/// How the weights of a convolution begin.
enum class Init { he, xavier, zero };

/// Value 0 is the input of the network, value k the result of layers[k-1], the last one its output.
struct Layer {
  LayerKind kind = LayerKind::conv;
  int input = 0;
  int other = -1;    // of add and concat
  int channels = 1;  // of the result
  int extent = 1;    // of conv: cells along each axis, odd
  int stride = 1;    // of conv, pools and upsample
  int dilation = 1, groups = 1;
  bool bias = true;
  Init init = Init::he;
  double gain = 1;
  Activation activation = Activation::relu;
  int weights_of = 0;  // of conv: the value of the one whose weights it has (which has its own); 0: its own
  // of reorient, from 1 on, negative for backwards: the axis of the input along which each axis of the result lies, and
  // the channels of the input that those of the result are (negative: times -1); none: as they are
  std::array<int, 3> axes{1, 2, 3};
  std::vector<int> order = {};
  double factor = 0;  // of scale, fix_sum (the sum), leaky_relu (the slope below 0)
  bool operator==(const Layer&) const = default;
};

struct Network {
  std::string name;
  int inputs = 1, outputs = 1;   // channels
  std::vector<Padding> padding;  // one an axis
  std::vector<Layer> layers;
  std::uint64_t seed = 0;
  Precision real = Precision::f32;
  std::int64_t host_weights = -1;  // >= 0: not layers but a function of the host, with so many weights
  bool is_host() const { return host_weights >= 0; }
  int rank() const { return static_cast<int>(padding.size()); }
  bool operator==(const Network&) const = default;
};

/// A network or its derivative, done to fields: a statement of programs (stencil/stencil.h says what it means). ""
/// stands for a rate that is 0 and for a result that nobody wants.
struct NetworkCall {
  enum class Mode { value, tangent, adjoint, second };  // second: the adjoint of the tangent
  std::string network;
  Mode mode = Mode::value;
  std::vector<std::string> inputs;   // one a channel
  std::vector<std::string> rates;    // of the inputs; of the adjoint: seeds of the outputs; of second: both
  std::vector<std::string> results;  // outputs, their rates, or adjoints of the inputs; of second: then of their rates
  bool weights = false;
  bool operator==(const NetworkCall&) const = default;
};
/// How many rates and results there are in a mode.
std::size_t rate_count(const Network& network, NetworkCall::Mode mode);
std::size_t result_count(const Network& network, NetworkCall::Mode mode);
/// Whether it adds to what the weights get, where they are taken along.
bool adds_to_weights(NetworkCall::Mode mode);
/// The fields that are read and written, in order, without those that are not there.
std::vector<std::string> fields_read(const NetworkCall& network_call);
std::vector<std::string> fields_written(const NetworkCall& network_call);
/// adjoint corrector(a, b) by c_bar, _ to a_bar, b_bar weights
std::string text_of(const NetworkCall& network_call);

/// Of value `number`.
int channels_of(const Network& network, int number);
/// The first weight of layer `index` (a conv) and of its bias; -1 for what it has not.
std::int64_t weights_begin(const Network& network, int index);
std::int64_t bias_begin(const Network& network, int index);
std::int64_t weight_count(const Network& network);
/// By weights, for each cell of the scene's grid.
double multiplications_a_cell(const Network& network);
/// No convolution sees neighbours and no layer changes the grid: a function of the values in one cell.
bool is_pointwise(const Network& network);

std::string_view name_of(Activation activation);  // "leaky_relu"
std::string_view name_of(Padding padding);
std::string_view name_of(Init init);

}  // namespace dpde::network
