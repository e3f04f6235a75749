// SPDX-License-Identifier: Apache-2.0
// Implementations of Network: on the whole grid, or on blocks of cells if no layer reads neighbours.
#pragma once

#include <memory>

#include "dpde/network_abi.h"
#include "dpde/runtime/layout.h"
#include "dpde/runtime/network.h"
#include "dpde/runtime/tapes.h"
#include "dpde/runtime/team.h"

namespace dpde::nn {

class Runner {
 public:
  virtual ~Runner() = default;
  /// Returns false if they have not changed.
  virtual bool set_weights(const double* weights) = 0;
  /// For networks that the host computes.
  virtual void set_host(const dpde_host_network* /*host*/) {}
  virtual void value(void* const* inputs, void* const* outputs) = 0;
  virtual void tangent(void* const* inputs, void* const* input_rates, const double* weight_rates,
                       void* const* output_rates) = 0;
  virtual void adjoint(void* const* inputs, void* const* seeds, void* const* input_bars, double* weight_bars) = 0;
  /// Allocates the memory of second(); must be called before it.
  virtual void prepare_second() = 0;
  virtual void second(const NetworkSecond& call) = 0;
  virtual int64_t bytes() const = 0;
  // See Network.
  virtual int64_t tape_bytes() const { return 0; }
  virtual int64_t products() const { return 0; }
  virtual void write_tapes(Tapes* /*tapes*/) {}
  virtual void read_tapes(Tapes* /*tapes*/) {}
};

std::unique_ptr<Runner> make_runner(const dpde_network& network, const dpde_layout& layout, const Team& team);

}  // namespace dpde::nn
