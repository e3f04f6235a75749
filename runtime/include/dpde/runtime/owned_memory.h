// SPDX-License-Identifier: Apache-2.0
// Who holds memory beside the fields of a program, and how much.
#pragma once

#include <cstdint>
#include <string>

namespace dpde {

struct OwnedMemory {
  std::string owner;        // "solve for psi", "Fourier transforms"
  std::int64_t kept = 0;    // bytes, as long as the program is there
  std::int64_t making = 0;  // bytes beside them while it is made, in the first run
  std::string shared = {};  // programs that run in turns have one for all with this key; "": each its own
};

}  // namespace dpde
