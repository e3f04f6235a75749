// SPDX-License-Identifier: Apache-2.0
// Products of second derivatives: a run that carries states and rates forward through the tangent of the step, and the
// adjoint of that tangent back. With the rate of the loss at the end the adjoint of the states is the Hessian's
// product; with the squares of the residuals' rates at the end the adjoint of the rates is that of the Gauss-Newton
// matrix.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "dpde/runtime/error.h"
#include "dpde/runtime/links.h"
#include "simulation_impl.h"

namespace dpde {
RolloutSetup Simulation::Impl::second_setup(Curvature curvature) {
  for (int32_t c = 0; c < scene.sought_count; ++c) {
    const std::string rate(rate_of(DPDE_LINK_FIELD, scene.sought[c]));
    if (rate.empty()) continue;
    field(rate);
    const HostField& host = host_field_named(scene.sought[c]);
    if (host.every > 0) make_control_field(rate, host.every, static_cast<int32_t>(host.states));
  }
  RolloutSetup both = setup();
  both.step = scene.second.tangent;
  both.adjoint = scene.second.adjoint;
  for (int32_t c = 0; c < scene.sought_count; ++c) {
    both.sought.emplace_back(scene.sought[c]);
    if (const std::string rate(rate_of(DPDE_LINK_FIELD, scene.sought[c])); !rate.empty()) both.sought.push_back(rate);
  }
  for (int32_t i = 0; i < scene.loss_count; ++i) {
    const dpde_loss& loss = scene.losses[i];
    const dpde_second& programs = curvature == Curvature::full ? loss.full : loss.squares;
    if (programs.tangent == nullptr) {
      throw Error(
          ErrorKind::input,
          fmt::format("loss {} of task {} is not a sum of squares: it has no Gauss-Newton matrix", i + 1, scene.task));
    }
    LossTerm term = loss_term(loss, *programs.tangent);
    term.adjoint = programs.adjoint;
    term.sum = rate_in(*programs.tangent, DPDE_LINK_SUM, "loss");
    both.losses.push_back(std::move(term));
  }
  return both;
}

Rollout& Simulation::Impl::second_order(Curvature curvature) {
  objective();  // or an error: there is no task
  if (scene.no_second != nullptr) throw Error(ErrorKind::input, scene.no_second);
  std::optional<Rollout>& rollout = curvature == Curvature::full ? full : gauss_newton;
  if (!rollout) {
    rollout.emplace(second_setup(curvature));
    give_controls(*rollout);
    rollout->watch_gradient(watch, watch_every);
  }
  return *rollout;
}

/// Rates of parameters and controls; of fields that formulas give; then of those that are unknowns themselves.
void Simulation::Impl::set_direction(Rollout& rollout, Values direction) {
  const std::span<const double> all = direction;
  update_formulas();  // tangents may read what formulas give
  for (const Unknown& unknown : unknowns) {
    const std::span<const double> rates = unknown.part_of(all);
    if (unknown.kind == DPDE_UNKNOWN_PARAM) {
      params[unknown.rate] = rates[0];
      rollout.set_param(unknown.rate, rates[0]);
    } else if (unknown.kind == DPDE_UNKNOWN_CONTROL) {
      const auto same = [&](const dpde_control& control) { return unknown.name == control.name; };
      rollout.set_control(unknown.rate, std::find_if(scene.controls, scene.controls + scene.control_count, same)->every,
                          rates);
    }
  }
  keeping_given([&] {
    for (const dpde_second* formulas : {&scene.coefficient_second, &scene.initial_second}) {
      if (formulas->tangent != nullptr) execute(*formulas->tangent);
    }
  });
  formulas_are_stale =
      true;  // the tangents have computed the fields, too, and those that a task starts elsewhere are not so
  const auto copy_rates = [&](const std::string& name, const Unknown* unknown, void* to) {
    if (unknown != nullptr) {
      copy_in(layout, to, unknown->part_of(all));
    } else if (!comes_from_formula(name) || rate_of(DPDE_LINK_FIELD, name).empty()) {
      fill_all(layout, to, 0);
    } else if (Field& rates = field(rate_of(DPDE_LINK_FIELD, name)); to != rates.base()) {
      copy_all(layout, to, rates.base());
    }
  };
  const auto sought_as = [&](int32_t kind, std::string_view name) {
    const auto found =
        std::ranges::find_if(unknowns, [&](const Unknown& u) { return u.kind == kind && u.name == name; });
    return found == unknowns.end() ? nullptr : &*found;
  };
  for (const InitialState& state : initial_states) {
    const int rate = rollout.state_index(rate_of(DPDE_LINK_FIELD, state.name));
    if (rate >= 0) copy_rates(state.name, sought_as(DPDE_UNKNOWN_INITIAL, state.name), rollout.initial(rate).base());
  }
  for (int32_t c = 0; c < scene.sought_count; ++c) {
    const Unknown* unknown = sought_as(DPDE_UNKNOWN_COEFFICIENT, scene.sought[c]);
    const std::string rate(rate_of(DPDE_LINK_FIELD, scene.sought[c]));
    if (rate.empty()) continue;
    if (unknown != nullptr && host_field_named(scene.sought[c]).every > 0) {
      copy_in_all(rate, unknown->part_of(all));
      continue;
    }
    copy_rates(scene.sought[c], sought_as(DPDE_UNKNOWN_COEFFICIENT, scene.sought[c]), field(rate).base());
  }
}

void Simulation::Impl::product(Values direction, Target to, Curvature curvature) {
  require_size(direction, "direction");
  require_size(Values(to), "product");
  Rollout& rollout = second_order(curvature);
  set_direction(rollout, direction);
  begin_objective(rollout);
  was_stopped = rollout.gradient().stopped;
  if (was_stopped) {
    std::ranges::fill(to, std::numeric_limits<double>::quiet_NaN());
    return;
  }
  const bool of_rates = curvature == Curvature::gauss_newton;
  copy_bars(rollout, of_rates, to);
  add_through_formulas(rollout, of_rates, scene.initial_second.adjoint, scene.coefficient_second.adjoint, to);
}

std::vector<double> Simulation::hessian_vector(Values direction, Curvature curvature) {
  std::vector<double> product(direction.size());
  hessian_vector(direction, product, curvature);
  return product;
}

void Simulation::hessian_vector(Values direction, Target product, Curvature curvature) {
  impl_->product(direction, product, curvature);
  const bool finite = std::ranges::all_of(product, [](double value) { return std::isfinite(value); });
  if (!impl_->was_stopped && !finite) impl_->refuse(impl_->second_order(curvature), "the product with the Hessian");
}

}  // namespace dpde
