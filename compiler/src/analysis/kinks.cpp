// SPDX-License-Identifier: Apache-2.0
#include "analysis/kinks.h"

#include <algorithm>

#include "driver/switches.h"
#include "stencil/build.h"
#include "support/match.h"

namespace dpde::analysis {

namespace {

bool is_kink(const stencil::Expr& e) {
  const stencil::Call* call = std::get_if<stencil::Call>(&e->kind);
  const bool bends =
      call != nullptr && (call->fn == Fn::abs || call->fn == Fn::min || call->fn == Fn::max || call->fn == Fn::sign);
  return bends || std::holds_alternative<stencil::Select>(e->kind) || std::holds_alternative<stencil::Interp>(e->kind);
}

bool bends(const network::Layer& layer) {
  const bool is_rectifier =
      layer.activation == network::Activation::relu || layer.activation == network::Activation::leaky_relu;
  return layer.kind == network::LayerKind::max_pool || (layer.kind == network::LayerKind::activate && is_rectifier);
}

bool has_extremes(const std::vector<stencil::Statement>& statements) {
  return std::ranges::any_of(statements, [](const stencil::Statement& statement) {
    return match(
        statement, [](const stencil::Fill&) { return false; }, [](const stencil::Fold&) { return false; },
        [](const stencil::Reduce& reduce) { return reduce.kind == Reduction::max || reduce.kind == Reduction::min; },
        [](const stencil::NetworkCall&) { return false; }, [](const stencil::Transform&) { return false; },
        [](const stencil::Run&) { return false; }, [](const stencil::Solve& solve) { return has_extremes(solve.body); },
        [](const stencil::Repeat& repeat) { return has_extremes(repeat.body); });
  });
}

}  // namespace

bool has_kinks(const driver::Compiled& compiled) {
  bool found = false;
  const auto look = [&](const stencil::Expr& value) {
    stencil::visit(value, [&](const stencil::Expr& e) { found = found || is_kink(e); });
  };
  for (const auto& [name, derived] : compiled.derived) {
    const stencil::Module module = driver::extract(compiled.stencil, {name});
    found = found || has_extremes(module.programs.front().body);
    for (const network::Network& network : module.networks) found = found || std::ranges::any_of(network.layers, bends);
    for (const stencil::Kernel& kernel : module.kernels) {
      found = found || !kernel.scatters.empty();
      for (const stencil::Let& let : kernel.lets) look(let.value);
      for (const stencil::Store& store : kernel.stores) look(store.value);
      for (const stencil::Sum& sum : kernel.sums) look(sum.value);
    }
  }
  return found;
}

bool has_jumps(const driver::Compiled& compiled) { return !driver::jumps_of(compiled).empty(); }

}  // namespace dpde::analysis
