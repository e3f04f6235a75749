// SPDX-License-Identifier: Apache-2.0
// A network as an operation of a program: binds its fields. Inside the runtime only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/network.h"

namespace dpde {

class Inference {
 public:
  Inference() = default;
  Inference(const dpde_inference& source, const dpde_network& network);
  /// Index of the network in the program.
  std::size_t network() const { return network_; }
  /// Computes values for which no adjoint follows.
  void run_beside_tapes(Network& network, void* const* fields);
  /// `fields`: base pointers of the fields of the program.
  void run(Network& network, void* const* fields, const dpde_weights& weights);

 private:
  /// Indices of fields, -1 for absent ones, and space for their pointers.
  struct List {
    std::vector<int> fields;
    std::vector<void*> bases;
    void* const* bound(void* const* to);
  };
  std::size_t network_ = 0;
  int mode_ = DPDE_NETWORK_VALUE;
  bool weights_ = false;
  List inputs_, rates_, results_;
};

/// How often a run of the program applies a network in a mode (DPDE_NETWORK_VALUE ...).
std::int64_t applications(const dpde_program& program, int network, int mode);

}  // namespace dpde
