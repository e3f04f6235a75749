// SPDX-License-Identifier: Apache-2.0
// The C struct of network_abi.h for a network. It owns all arrays of the struct and must not move.
#pragma once

#include <string>
#include <vector>

#include "dpde/network_abi.h"
#include "network/network.h"

namespace dpde::codegen {

class NetworkTable {
 public:
  explicit NetworkTable(const network::Network& network);
  NetworkTable(const NetworkTable&) = delete;
  NetworkTable& operator=(const NetworkTable&) = delete;
  const std::string& name() const { return name_; }
  const dpde_network* get() const { return &table_; }

 private:
  std::string name_;
  std::vector<std::vector<int32_t>> orders_;  // for each layer
  std::vector<dpde_layer> layers_;
  dpde_network table_{};
};

}  // namespace dpde::codegen
