// SPDX-License-Identifier: Apache-2.0
#include "driver/scene/activity.h"

#include <algorithm>
#include <set>

#include "model/build.h"
#include "stencil/build.h"
#include "stencil/walk.h"
#include "support/names/bound_names.h"

namespace dpde::driver {

namespace {

/// Parameters in boundary values, which have no adjoint yet. Weights of mixed conditions have one.
std::set<std::string> params_of_boundaries(const stencil::Module& module) {
  std::set<std::string> params;
  const auto collect = [&](const stencil::Expr& e) {
    visit(e, [&](const stencil::Expr& part) {
      if (const stencil::Param* param = as<stencil::Param>(part)) params.insert(param->name);
    });
  };
  for (const stencil::Program& program : module.programs) {
    for_each_kind<stencil::Fill>(program.body, [&](const stencil::Fill& fill) {
      stencil::for_each_side(fill.axes, [&](const stencil::Side& side) { collect(side.value); });
    });
  }
  return params;
}

bool is_learned(const model::Problem& problem, const std::string& network) {
  return problem.task && std::ranges::any_of(problem.task->unknowns, [&](const model::Unknown& unknown) {
           return unknown.kind == model::Unknown::Kind::network && unknown.name == network;
         });
}

/// Whether the coefficient is an unknown or its formula contains one.
bool is_sought(const model::Problem& problem, const model::Coefficient& coefficient) {
  if (!problem.task) return false;
  const auto is_unknown = [&](const model::Unknown& unknown) {
    return unknown.kind == model::Unknown::Kind::coefficient && unknown.name == coefficient.name;
  };
  const auto reads_unknown = [&](const model::Expr& e) {
    const model::NetworkCall* network_call = as<model::NetworkCall>(e);
    if (network_call != nullptr) return is_learned(problem, network_call->network);
    const model::Param* param = as<model::Param>(e);
    const model::Parameter* known = param == nullptr ? nullptr : problem.find_param(param->name);
    return known != nullptr && known->unknown;
  };
  return std::any_of(problem.task->unknowns.begin(), problem.task->unknowns.end(), is_unknown) ||
         (coefficient.value.formula && any_part(*coefficient.value.formula, reads_unknown));
}

}  // namespace

adjoint::Activity activity_of(const Compiled& compiled, const CompileOptions& options) {
  adjoint::Activity wrt;
  const std::set<std::string> passive = params_of_boundaries(compiled.stencil);
  const auto add_param = [&](const std::string& name) {
    if (!find_bound_name(name) && !passive.contains(name)) wrt.params.insert(name);
  };
  if (!compiled.problem) {
    for (const stencil::Program& program : compiled.stencil.programs) {
      const stencil::Interface interface = stencil::interface_of(compiled.stencil, program);
      for (const std::string& field : interface.inputs) {
        if (!find_bound_name(field)) wrt.fields.insert(field);
      }
      for (const std::string& param : interface.params) add_param(param);
      wrt.params.insert(interface.networks.begin(), interface.networks.end());
    }
    return wrt;
  }
  for (const model::State& state : compiled.problem->states) wrt.fields.insert(state.name);
  for (const model::Coefficient& coefficient : compiled.problem->coefficients) {
    if (options.by_everything || is_sought(*compiled.problem, coefficient)) wrt.fields.insert(coefficient.name);
  }
  for (const network::Network& network : compiled.problem->networks) {
    if (options.by_everything || options.certify || is_learned(*compiled.problem, network.name))
      wrt.params.insert(network.name);
  }
  for (std::size_t i = 0; compiled.problem->task && i < compiled.problem->task->losses.size(); ++i) {
    const std::string& average = compiled.problem->task->losses[i].average;
    if (!average.empty()) wrt.params.insert(average);
  }
  for (const model::Parameter& param : compiled.problem->params) {
    if (!param.unknown && !options.by_everything) continue;
    // Unknowns of a task are always kept: if there is no derivative, that is an error.
    if (param.unknown && !(compiled.problem->task && compiled.problem->task->certifies)) {
      wrt.params.insert(param.name);
    } else {
      add_param(param.name);
    }
  }
  return wrt;
}

}  // namespace dpde::driver
