// SPDX-License-Identifier: Apache-2.0
// Neural networks over the cells of a grid, as described by network_abi.h: values, tangents and adjoints.
//
// Each channel of a value is a plane with margins; convolutions of any rank, dilation and number of groups are sums
// over lists of offsets in it. Networks without neighbours run all their layers in blocks of cells that stay in the
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

/// The initial weights of the network, doubles in the order of network_abi.h. A weight depends only on the seed and on
/// its index.
std::vector<double> initial_weights(const dpde_network& network, std::uint64_t seed);

/// Arguments of Network::second(): inputs first, then results.
struct NetworkSecond {
  void* const* inputs = nullptr;
  void* const* input_rates = nullptr;
  void* const* seeds = nullptr;       // adjoints of the outputs' rates
  void* const* input_bars = nullptr;  // results: adjoints of the inputs
  void* const* input_rate_bars = nullptr;
  const double* weight_rates = nullptr;
  double* weight_bars = nullptr;       // added to
  double* weight_rate_bars = nullptr;  // likewise
};

/// One network on one grid with all its working memory: runs allocate nothing. Results do not depend on the number of
/// threads. For use by one thread at a time.
class Network {
 public:
  /// Weights are 0 until they are set. `network` need not outlive the object. `twice`: second() will be called, too.
  /// @throws Error(input) if the network is broken or does not fit the grid, Error(machine) if memory runs out.
  Network(const dpde_network& network, const dpde_layout& layout, const Team& team = 1, bool twice = false);
  ~Network();
  Network(Network&&) noexcept;
  Network& operator=(Network&&) noexcept;

  /// Copies the weights in the precision of the network; cheap if they have not changed.
  void set_weights(const double* weights);
  /// Functions of a network that the host computes, for later runs; *host must stay valid.
  void set_host(const dpde_host_network* host);

  // Fields: pointers to cell (0, 0, 0) of memory with the layout, of doubles or floats by layout.real. Only interior
  // cells are read and written. Inputs and outputs may be the same fields.

  void value(void* const* inputs, void* const* outputs);
  /// The same if no adjoint follows: records no tape.
  void value_beside_tapes(void* const* inputs, void* const* outputs);

  /// Rates of the outputs from those of the inputs and of the weights; null rates are 0.
  void tangent(void* const* inputs, void* const* input_rates, const double* weight_rates, void* const* output_rates);

  /// Adjoints of the inputs and weights from those of the outputs (`seeds`; null ones are 0). Null `input_bars`, and
  /// null entries of it, are not computed; the others are overwritten. `weight_bars`, unless null, are added to. Runs
  /// forward first if there is no tape.
  void adjoint(void* const* inputs, void* const* seeds, void* const* input_bars, double* weight_bars);

  /// The adjoint of tangent(): from the adjoints of the outputs' rates those of inputs and weights and of the rates of
  /// both. Null inputs are 0, null results are not computed. Adjoints of the outputs themselves: adjoint().
  void second(const NetworkSecond& call);

  /// Memory use.
  std::int64_t bytes() const;

  /// Tapes store intermediate results of value() for adjoint() of another object with the same network, grid and
  /// weights. The one writes them while the tapes are recording; the other uses them in place of its own forward run.
  /// Results are bit-identical.
  void write_tapes(std::shared_ptr<Tapes> tapes);
  void read_tapes(std::shared_ptr<Tapes> tapes);
  /// Bytes of the tape of one run; 0 if recomputing is as cheap as storing.
  std::int64_t tape_bytes() const;
  /// Multiplications of weights and values that one tape saves.
  std::int64_t products() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dpde
