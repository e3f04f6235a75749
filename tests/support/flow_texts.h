// SPDX-License-Identifier: Apache-2.0
// Flow models shared by several tests.
#pragma once

namespace dpde::testing {

/// Fluid of one density.
constexpr const char* incompressible_flow = R"(
model flow {
  vector u on faces
  field p
  param nu
  dt(u) = -advect(u, u) - grad(p) + nu*lap(u)
  0 = div(u) gives p
}
)";

/// Fluid around an obstacle.
constexpr const char* flow_around_a_solid = R"(
model m {
  vector u on faces
  field p
  param nu
  mask solid
  dt(u) = -advect(u, u) - grad(p) + nu*lap(u)
  0 = div(u) gives p
  u = 0 inside solid
}
)";

/// Vortices over a bed of uneven depth: a stream function by a declared equation.
constexpr const char* flow_over_an_uneven_bed = R"(
model m {
  field w
  coefficient k
  param nu
  solve div(k*grad(psi)) = w for psi
  dt(w) = -dy(psi)*dx(w) + dx(psi)*dy(w) + nu*lap(w)
}
)";

}  // namespace dpde::testing
