// SPDX-License-Identifier: Apache-2.0
#include "analysis/kinks.h"

#include <algorithm>

#include "adjoint/reverse/plan.h"
#include "stencil/build.h"
#include "stencil/walk.h"

namespace dpde::analysis {

namespace {

/// Whether any part of `e` depends on an active variable, also conditions and positions, which have no derivative.
bool moves(const stencil::Expr& e, const adjoint::Varied& varied) {
  return any_part(e, [&](const stencil::Expr& part) {
    const auto* param = as<stencil::Param>(part);
    const auto* local = as<stencil::Local>(part);
    const auto* access = as<stencil::Access>(part);
    const auto* interp = as<stencil::Interp>(part);
    return (param != nullptr && varied.params.contains(param->name)) ||
           (local != nullptr && varied.locals.contains(local->name)) ||
           (access != nullptr && varied.fields.contains(access->field)) ||
           (interp != nullptr && varied.fields.contains(interp->field));
  });
}

bool has_moving_place(const stencil::Interp& interp, const adjoint::Varied& varied) {
  return std::ranges::any_of(interp.displacement, [&](const stencil::Expr& e) { return moves(e, varied); });
}

bool bends_or_jumps(Fn fn) {
  return fn == Fn::abs || fn == Fn::min || fn == Fn::max || fn == Fn::sign || fn == Fn::floor || fn == Fn::fraction;
}

/// A switch that no unknown moves, as one by t or coordinates, is no kink.
bool is_kink(const stencil::Expr& e, const adjoint::Varied& varied) {
  if (const auto* call = as<stencil::Call>(e)) return bends_or_jumps(call->fn) && moves(e, varied);
  if (const auto* select = as<stencil::Select>(e)) return moves(select->condition, varied);
  const auto* interp = as<stencil::Interp>(e);
  return interp != nullptr && has_moving_place(*interp, varied);
}

bool has_kink(const stencil::Kernel& kernel, adjoint::Varied varied) {
  varied.locals.clear();
  for (const stencil::Let& let : kernel.lets) {
    if (moves(let.value, varied)) varied.locals.insert(let.name);
  }
  const auto moves_target = [&](const stencil::Scatter& scatter) { return has_moving_place(scatter.target, varied); };
  return std::ranges::any_of(kernel.scatters, moves_target) ||
         any_part(kernel, [&](const stencil::Expr& e) { return is_kink(e, varied); });
}

bool bends(const network::Layer& layer) {
  const bool is_rectifier =
      layer.activation == network::Activation::relu || layer.activation == network::Activation::leaky_relu;
  return layer.kind == network::LayerKind::max_pool || (layer.kind == network::LayerKind::activate && is_rectifier);
}

bool has_extremes(const std::vector<stencil::Statement>& statements, const adjoint::Varied& varied) {
  const auto is_extreme = [&](const stencil::Reduce& reduce) {
    return (reduce.kind == Reduction::max || reduce.kind == Reduction::min) && varied.fields.contains(reduce.field);
  };
  return find_kind<stencil::Reduce>(statements, is_extreme) != nullptr;
}

}  // namespace

bool has_kinks(const driver::Compiled& compiled) {
  return std::ranges::any_of(compiled.derived, [&](const auto& one) {
    const std::string& name = one.first;
    const stencil::Module module = driver::extract(compiled.stencil, {name});
    const stencil::Program& program = module.programs.front();
    const adjoint::Varied varied = adjoint::find_varied(module, program, driver::active_inputs(compiled, name));
    return has_extremes(program.body, varied) ||
           std::ranges::any_of(
               module.networks,
               [](const network::Network& network) { return std::ranges::any_of(network.layers, bends); }) ||
           std::ranges::any_of(module.kernels, [&](const stencil::Kernel& kernel) { return has_kink(kernel, varied); });
  });
}

bool has_jumps(const driver::Compiled& compiled) {
  return !compiled.jumps_left_out.empty() || !compiled.watched.empty();
}

}  // namespace dpde::analysis
