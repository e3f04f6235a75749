// SPDX-License-Identifier: Apache-2.0
// Small stencil programs, built by hand, for tests of the loop level and of the back ends.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "stencil/build.h"
#include "stencil/stencil.h"

namespace dpde::samples {

using namespace stencil;  // NOLINT: a test helper that is all about stencils

/// A run, under a name that is no member of testing::Test.
inline Run run(std::string kernel, int grow = 0) { return {std::move(kernel), grow}; }
inline AxisBoundary periodic() { return {Topology::periodic, {}, {}}; }
inline AxisBoundary wall(Expr low, Expr high) {
  return {Topology::bounded, {SideKind::value, std::move(low)}, {SideKind::value, std::move(high)}};
}
inline AxisBoundary insulated() {
  return {Topology::bounded, {SideKind::zero_gradient, 0.0}, {SideKind::zero_gradient, 0.0}};
}
inline std::vector<Topology> topologies(const std::vector<AxisBoundary>& axes) {
  std::vector<Topology> result;
  for (const AxisBoundary& axis : axes) result.push_back(axis.topology);
  return result;
}

/// u_next = u + dt*(-u*ux + nu*(u[-1] - 2*u + u[+1])/hx^2), ux = (u[+1] - u[-1])/(2*hx)
inline Kernel burgers_kernel() {
  const Expr u = access("u"), left = access("u", {-1}), right = access("u", {1});
  const Expr hx = param("hx");
  const Expr second = param("nu") * (left - 2 * u + right) / power(hx, 2);
  Kernel kernel{.name = "burgers_step", .rank = 1};
  kernel.lets = {{"ux", (right - left) / (2 * hx)}};
  kernel.stores = {{"u_next", false, u + param("dt") * (-u * local("ux") + second), {}}};
  return kernel;
}

inline Module burgers() {
  Program program{.name = "burgers_step", .axes = {Topology::periodic}};
  program.body = {Fill{"u", {periodic()}}, Run{"burgers_step"}};
  program.swaps = {{"u", "u_next"}};
  return {{burgers_kernel()}, {program}, {}};
}

/// u_next = u + dt*kappa*(d2/dx2 + d2/dy2) u, hot wall on the left, insulated in y
inline Module heat_2d() {
  const auto second = [](Offset low, Offset high, const char* spacing) {
    return (access("u", low) - 2 * access("u") + access("u", high)) / power(param(spacing), 2);
  };
  Kernel kernel{.name = "heat_step", .rank = 2};
  const Expr laplacian = second({-1, 0}, {1, 0}, "hx") + second({0, -1}, {0, 1}, "hy");
  kernel.stores = {{"u_next", false, access("u") + param("dt") * param("kappa") * laplacian, {}}};
  const std::vector<AxisBoundary> walls = {wall(param("hot"), 0.0), insulated()};
  Program program{.name = "heat_step", .axes = topologies(walls)};
  program.body = {Fill{"u", walls}, Run{"heat_step"}};
  program.swaps = {{"u", "u_next"}};
  return {{kernel}, {program}, {}};
}

}  // namespace dpde::samples
