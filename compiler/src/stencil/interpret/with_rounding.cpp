// SPDX-License-Identifier: Apache-2.0
#include "stencil/interpret/with_rounding.h"

#include <set>
#include <string>
#include <vector>

#include "stencil/build.h"
#include "stencil/space/comparisons.h"

namespace dpde::stencil {

namespace {

Expr with_rounding(const Expr& e, int& nodes, double phase, double size) {
  const bool is_interp = std::holds_alternative<Interp>(e->kind);
  if (is_decision(e) && !is_interp) return e;
  const Expr inner =
      is_interp ? e : map_children(e, [&](const Expr& child) { return with_rounding(child, nodes, phase, size); });
  const bool rounds = std::holds_alternative<Binary>(e->kind) || std::holds_alternative<Call>(e->kind) || is_interp;
  if (!rounds) return inner;
  ++nodes;
  const Expr place = 100.0 * nodes * access("x") + phase * nodes;
  return inner * (1.0 + size * call(Fn::sin, {place}));
}

}  // namespace

Module with_rounding(Module module, double phase, double size) {
  int nodes = 0;
  for (Kernel& kernel : module.kernels) {
    const std::set<std::string> decisive = decisive_lets(kernel);
    const std::vector<Let> lets = kernel.lets;
    kernel = map_kernel(kernel, [&](const Expr& value) { return with_rounding(value, nodes, phase, size); });
    for (std::size_t i = 0; i < lets.size(); ++i) {
      if (decisive.contains(lets[i].name)) kernel.lets[i] = lets[i];
    }
  }
  return module;
}

}  // namespace dpde::stencil
