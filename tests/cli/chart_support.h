// SPDX-License-Identifier: Apache-2.0
// Scenes shared by tests of charts.
#pragma once

#include "command_support.h"

namespace dpde::testing {

/// Advection of a sine once around, and decay of a sine by diffusion.
inline std::string wind(bool with_exact) {
  return std::string("model wind { field u; param c; dt(u) = -advect(c, u) }\n") +
         "scheme plain { advect = central(2); time = rk4 }\nscene ring : wind with plain {\n"
         "  grid x = 0 .. 2*pi, cells 32, periodic\n  c = 1\n  initial u = sin(x)\n" +
         (with_exact ? "  exact u = sin(x - c*t)\n" : "") + "  time 0 .. 1, step 1/32\n}\n";
}

class ChartCommand : public Command {
 protected:
  const std::string quick = " --samples 1 --sample-seconds 0 --json ";
};

}  // namespace dpde::testing
