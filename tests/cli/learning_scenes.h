// SPDX-License-Identifier: Apache-2.0
// Small scenes for tests of training: Burgers' equation on 16 cells, its data on 8, and no network.
#pragma once

#include <string>

namespace dpde::testing {

inline const std::string scenes_without_network = R"(
model burgers { field u; param nu; param phase; dt(u) = -u*dx(u) + nu*lap(u) }
scheme plain { time = rk2 }
scene fine : burgers with plain {
  grid x = 0 .. 2*pi, cells 16, periodic
  nu = 0.05; phase = 0
  initial u = sin(x) + 0.3*cos(2*x + phase)
  time 0 .. 1/2, step 1/32
}
scene bare = fine { cells 8 }
dataset train : fine { runs 2; seed 1; vary phase in 0 .. 6; frames every 1/32; coarsen 2; file "train.nc" }
dataset unseen : fine { runs 2; seed 2; vary phase in 0 .. 6; frames every 1/32; coarsen 2; file "unseen.nc" }
)";

}  // namespace dpde::testing
