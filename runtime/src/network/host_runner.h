// SPDX-License-Identifier: Apache-2.0
// A network that the host computes: copies fields to dense arrays and back.
#pragma once

#include <memory>

#include "network/runner.h"

namespace dpde::nn {

std::unique_ptr<Runner> make_host_runner(const dpde_network& network, const dpde_layout& layout);

}  // namespace dpde::nn
