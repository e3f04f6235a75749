// SPDX-License-Identifier: Apache-2.0
// Networks as text: layers as values, `let v2 = relu(v1)`, in the grammar of a .dpde file.
#pragma once

#include <string>

#include "network/network.h"

namespace dpde::network {

/// network NAME(3) -> 2 { ... }, with a final line break.
std::string print(const Network& network);

}  // namespace dpde::network
