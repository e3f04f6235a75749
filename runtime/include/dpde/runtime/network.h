// SPDX-License-Identifier: Apache-2.0
// Neural networks over the cells of a grid, as network_abi.h describes them: their values, rates and adjoints.
//
// Values are planes with margins, one a channel; convolutions of any rank, dilation and number of groups are sums over
// lists of places in them. Networks without neighbours run through all their layers in blocks of cells that stay in the
// cache.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "dpde/kernel_abi.h"
#include "dpde/network_abi.h"
#include "dpde/runtime/tapes.h"
#include "dpde/runtime/team.h"

namespace dpde {

/// The weights that the network begins with, doubles in the order of network_abi.h. A weight depends on the seed and on
/// its place among the weights, on nothing else.
std::vector<double> initial_weights(const dpde_network& network, std::uint64_t seed);

/// From and to where Network::second() goes.
struct NetworkSecond {
  void* const* inputs = nullptr;
  void* const* input_rates = nullptr;
  void* const* seeds = nullptr;       // adjoints of the outputs' rates
  void* const* input_bars = nullptr;  // to these
  void* const* input_rate_bars = nullptr;
  const double* weight_rates = nullptr;
  double* weight_bars = nullptr;       // added to
  double* weight_rate_bars = nullptr;  // likewise
};

/// One network on one grid with all memory it works in: what runs allocates nothing. Results do not depend on the
/// number of threads. To be used by one thread at a time.
class Network {
 public:
  /// Weights are 0 until they are set. The network may go away.
  /// @throws Error(input) when the network is broken or does not fit the grid, Error(machine) when there is no memory.
  /// `twice`: second() is asked for, too.
  Network(const dpde_network& network, const dpde_layout& layout, const Team& team = 1, bool twice = false);
  ~Network();
  Network(Network&&) noexcept;
  Network& operator=(Network&&) noexcept;

  /// Takes a copy in the precision of the network; costs little where they are those that are there.
  void set_weights(const double* weights);
  /// What a network that the host computes runs from now on; it must stay.
  void set_host(const dpde_host_network* host);

  // Fields: pointers to cell (0, 0, 0) of memory with the layout, of doubles or floats by layout.real. Interior cells
  // only are read and written. Inputs and outputs may be the same fields.

  void value(void* const* inputs, void* const* outputs);
  /// The same where no adjoint follows: tapes are left alone.
  void value_beside_tapes(void* const* inputs, void* const* outputs);

  /// Rates of the outputs for those of the inputs and of the weights; null ones are 0.
  void tangent(void* const* inputs, void* const* input_rates, const double* weight_rates, void* const* output_rates);

  /// Adjoints of the inputs and weights from those of the outputs (`seeds`; null ones are 0). Null `input_bars`, and
  /// null ones among them, are not wanted; what is there is replaced. `weight_bars`, unless null, are added to. Runs
  /// forward by itself where no tape tells.
  void adjoint(void* const* inputs, void* const* seeds, void* const* input_bars, double* weight_bars);

  /// The adjoint of tangent(): from the adjoints of the outputs' rates those of inputs, weights and the rates of both.
  /// What is null is 0, or not wanted. The adjoints of the outputs themselves go through adjoint().
  void second(const NetworkSecond& call);

  /// Of memory.
  std::int64_t bytes() const;

  /// What value() computes on the way for the adjoint() of another object of the same network, grid and weights: one
  /// keeps it while the tapes are recording, the other one looks there before it runs forward. Results are the same to
  /// the last bit.
  void write_tapes(std::shared_ptr<Tapes> tapes);
  void read_tapes(std::shared_ptr<Tapes> tapes);
  /// Of one run; 0 where computing it again costs no more than keeping it.
  std::int64_t tape_bytes() const;
  /// Of weights and values, that one of these spares.
  std::int64_t products() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dpde
