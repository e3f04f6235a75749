// SPDX-License-Identifier: Apache-2.0
// The unknowns of a task as one vector, and the task's optimiser on it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "dpde/runtime/error.h"
#include "simulation_impl.h"

namespace dpde {
namespace {

Values values_in(const Eigen::VectorXd& x) { return {x.data(), static_cast<std::size_t>(x.size())}; }

Method method_of(const dpde_optimiser& optimiser) {
  switch (optimiser.method) {
    case DPDE_GRADIENT_DESCENT: return {Method::Kind::gradient_descent, optimiser.rate};
    case DPDE_ADAM: return {Method::Kind::adam, optimiser.rate};
    case DPDE_NEWTON_CG: return {Method::Kind::newton_cg, optimiser.rate};
    default: return {Method::Kind::lbfgs, optimiser.rate};
  }
}

}  // namespace

void Simulation::Impl::require_size(Values values, std::string_view what) const {
  if (scene.task == nullptr)
    throw Error(ErrorKind::input, fmt::format("scene {} was compiled without a task: it has no unknowns", scene.name));
  if (values.size() == gradient_values.size()) return;
  throw Error(ErrorKind::input, fmt::format("the unknowns of task {} are {} values, the {} has {}", scene.task,
                                            gradient_values.size(), what, values.size()));
}

void Simulation::Impl::values_of(const Unknown& unknown, std::span<double> to) {
  switch (unknown.kind) {
    case DPDE_UNKNOWN_PARAM: to[0] = param_named(unknown.name); return;
    case DPDE_UNKNOWN_CONTROL: std::ranges::copy(control_named(unknown.name), to.begin()); return;
    case DPDE_UNKNOWN_NETWORK: std::ranges::copy(weights_named(unknown.name), to.begin()); return;
    default: break;
  }
  update_formulas();
  if (unknown.kind == DPDE_UNKNOWN_COEFFICIENT) {
    copy_out_all(unknown.name, to);
  } else {
    initial[static_cast<size_t>(state_named(unknown.name))].copy_out(to);
  }
}

void Simulation::Impl::set_unknowns(Values x) {
  require_size(x, "vector of values");
  for (const Unknown& unknown : unknowns) {
    const std::span<const double> values = unknown.part_of(std::span<const double>(x));
    switch (unknown.kind) {
      case DPDE_UNKNOWN_PARAM: set_param(unknown.name, values[0]); break;
      case DPDE_UNKNOWN_CONTROL: set_control(unknown.name, values); break;
      case DPDE_UNKNOWN_NETWORK: set_weights(unknown.name, values); break;
      case DPDE_UNKNOWN_COEFFICIENT: {
        copy_in_all(unknown.name, values);
        host_field_named(unknown.name).is_given = true;
        formulas_are_stale = true;  // of initial states that read it
        break;
      }
      default: {
        const auto s = static_cast<size_t>(state_named(unknown.name));
        initial[s].copy_in(values);
        initial_states[s].is_given = true;
      }
    }
  }
}

/// As tasks say it: infinite where an unknown has none; empty when none has any.
Bounds Simulation::Impl::bounds() const {
  const auto is_bounded = [](const Unknown& unknown) {
    return std::isfinite(unknown.low) || std::isfinite(unknown.high);
  };
  if (std::ranges::none_of(unknowns, is_bounded)) return {};
  const auto size_of_all = static_cast<Eigen::Index>(gradient_values.size());
  Bounds bounds{Eigen::VectorXd(size_of_all), Eigen::VectorXd(size_of_all)};
  for (const Unknown& unknown : unknowns) {
    const auto offset = static_cast<Eigen::Index>(unknown.offset), count = static_cast<Eigen::Index>(unknown.size);
    bounds.low.segment(offset, count).setConstant(unknown.low);
    bounds.high.segment(offset, count).setConstant(unknown.high);
  }
  return bounds;
}

Optimised Simulation::Impl::optimise(const OptimiserCallback& progress, int iterations) {
  objective();  // or an error: there is no task
  was_stopped = false;
  const dpde_optimiser& optimiser = scene.optimiser;
  const Curvature curvature = optimiser.gauss_newton != 0 ? Curvature::gauss_newton : Curvature::full;
  if (optimiser.method == DPDE_NEWTON_CG) second_order(curvature);  // or an error, before anything runs
  Eigen::VectorXd start(static_cast<Eigen::Index>(gradient_values.size()));
  const std::span<double> first(start.data(), gradient_values.size());
  for (const Unknown& unknown : unknowns) values_of(unknown, unknown.part_of(first));
  const Objective loss = [&](const Eigen::VectorXd& x, Eigen::VectorXd& slope) {
    if (was_stopped) return std::numeric_limits<double>::quiet_NaN();  // a line search would try again
    set_unknowns(values_in(x));
    const double value = gradient();
    std::ranges::copy(gradient_values, slope.data());
    return value;
  };
  const HessianProduct hessian = [&](const Eigen::VectorXd& x, const Eigen::VectorXd& v, Eigen::VectorXd& result) {
    set_unknowns(values_in(x));
    product(values_in(v), {result.data(), static_cast<std::size_t>(result.size())}, curvature);
  };
  const IterationObserver observer = [&](const Iteration& now) {
    return !progress || progress({now.iteration, now.loss, now.gradient_norm});
  };
  const OptimiseResult done = minimise(method_of(optimiser), loss, hessian, start,
                                       iterations > 0 ? iterations : optimiser.iterations, observer, bounds());
  set_unknowns(values_in(done.x));
  return {was_stopped ? StopReason::observer : done.reason,
          done.loss,
          done.losses,
          done.iterations,
          done.evaluations,
          done.hessian_products};
}

std::vector<double> Simulation::value_of(std::string_view name) {
  const Unknown& unknown = impl_->unknown_named(name);
  std::vector<double> values(unknown.size);
  impl_->values_of(unknown, values);
  return values;
}

std::vector<double> Simulation::unknown_values() {
  std::vector<double> values(impl_->gradient_values.size());
  for (const Unknown& unknown : impl_->unknowns) impl_->values_of(unknown, unknown.part_of(std::span<double>(values)));
  return values;
}

void Simulation::set_unknowns(Values values) { impl_->set_unknowns(values); }

Optimised Simulation::optimise(const OptimiserCallback& progress, int iterations) {
  return impl_->optimise(progress, iterations);
}

}  // namespace dpde
