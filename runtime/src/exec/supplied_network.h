// SPDX-License-Identifier: Apache-2.0
// Wraps the functions of a HostNetwork as the C struct that programs call. Inside the runtime only.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "dpde/network_abi.h"
#include "dpde/runtime/host_network.h"

namespace dpde {

class SuppliedNetwork {
 public:
  /// `cells`: those of the grid.
  SuppliedNetwork(const dpde_network& network, std::size_t cells);
  SuppliedNetwork(const SuppliedNetwork&) = delete;
  SuppliedNetwork& operator=(const SuppliedNetwork&) = delete;

  void supply(HostNetwork functions);
  const dpde_host_network* table() const { return &table_; }

 private:
  using Values = std::vector<double>;
  void value(const double* inputs, const double* weights, double* outputs);
  void vector_jacobian(const double* inputs, const double* weights, const double* seeds, double* input_bars,
                       double* weight_bars);
  bool check(const double* inputs, const double* weights) const;
  bool check_along(const Values& inputs, const Values& weights, const Values& input_rates, const Values& weight_rates,
                   const char* what) const;

  std::string name_;
  std::size_t inputs_, outputs_, weights_;  // numbers of values
  HostNetwork functions_;
  bool is_checked_ = false, is_tried_ = false;  // whether its product, and its value, have been checked since supply()
  dpde_host_network table_{};
};

}  // namespace dpde
