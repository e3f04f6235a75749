// SPDX-License-Identifier: Apache-2.0
// Memory besides the fields of a program, by owner.
#pragma once

#include <cstdint>
#include <string>

namespace dpde {

struct OwnedMemory {
  std::string owner;        // "solve for psi", "Fourier transforms"
  std::int64_t kept = 0;    // bytes for the lifetime of the program
  std::int64_t making = 0;  // further bytes during setup, in the first run
  std::string shared = {};  // key: programs that run in turns share one allocation; "": not shared
};

}  // namespace dpde
