// SPDX-License-Identifier: Apache-2.0
// Losses, derivatives and the optimiser of a simulation with a task.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "dpde/runtime/error.h"
#include "dpde/runtime/unknown_scales.h"
#include "dpde/runtime/unsolved.h"
#include "host/simulation_impl.h"

namespace dpde {
namespace {

Values values_in(const Eigen::VectorXd& x) { return {x.data(), static_cast<std::size_t>(x.size())}; }

bool all_finite(std::span<const double> values) {
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}

Method method_of(const dpde_optimiser& optimiser) {
  switch (optimiser.method) {
    case DPDE_GRADIENT_DESCENT: return {Method::Kind::gradient_descent, optimiser.rate};
    case DPDE_ADAM: return {Method::Kind::adam, optimiser.rate};
    case DPDE_NEWTON_CG: return {Method::Kind::newton_cg, optimiser.rate};
    default: return {Method::Kind::lbfgs, optimiser.rate};
  }
}

}  // namespace

/// For a failed solve: adds its source location, and advice.
void Simulation::Impl::say_more(Error& error) const {
  const auto* unsolved = dynamic_cast<const Unsolved*>(&error);
  if (unsolved == nullptr) return;
  if (engine.options().explain) return engine.options().explain(error);
  if (const std::string hint = unsolved->hint(); !hint.empty())
    error.explain(std::string(error.what()) + "; " + hint, error.messages());
}

void Simulation::Impl::begin_objective() {
  engine.objective();  // throws if there is no task
  engine.update_formulas();
  require_given(true);
  require_followed(true);
  require_finite();
}

double Simulation::Impl::gradient() {
  begin_objective();
  return engine.gradient(gradient_values);
}

/// NaN if a solve has no solution: a line search then takes a shorter step.
double Simulation::Impl::gradient_or_none() {
  try {
    return gradient();
  } catch (const NoSolution&) {
    return std::numeric_limits<double>::quiet_NaN();
  }
}

/// Explains a value that is not finite. Optimisers do not call it: for them such a step is just too long. If all states
/// are finite, `what` is at fault.
void Simulation::Impl::refuse(Rollout& rollout, const std::string& what) {
  const std::optional<BlowUp> first = rollout.run().blow_up;
  const dpde_scene& scene = engine.scene();
  if (!first) {
    measure_start(rollout);
    for (const Growth& growth :
         growths_of(engine, start, rollout.final_states(), scene.steps, engine.t_begin() + scene.steps * scene.step))
      throw NotFinite(fmt::format("{} is not finite: {}", what, text_of(growth, scene.steps)));
  }
  if (!first)
    throw NotFinite(
        what +
        " is not finite, though all states are: a root or a power may have no derivative at 0, or a quotient no value");
  throw NotFinite(
      fmt::format("{} is no longer finite after step {} of {} (t = {:.6g}) in cell ({}, {}, {}); "
                  "a smaller step than {} may help",
                  rollout.state_name(first->state), first->step, engine.scene().steps, first->t, first->cell.x,
                  first->cell.y, first->cell.z, engine.scene().step));
}

void Simulation::Impl::look_for_growth_of_losses() {
  told = &of_losses;
  const FarState* const far = engine.objective().far_state();
  std::vector<double> found;
  for (std::size_t s = 0; far != nullptr && s < far->states.size(); ++s) {
    found.push_back(far->before[s]);
    found.push_back(largest_magnitude(engine.workspace().layout(), far->states[s]));
  }
  if (found == of_losses.judged) return;
  of_losses = {
      found, far == nullptr ? "" : text_of(growths_of(engine, far->before, far->states, far->step, far->t), far->step)};
}

void Simulation::Impl::measure_start(Rollout& rollout) {
  start.clear();
  for (int s = 0; s < rollout.state_count(); ++s)
    start.push_back(largest_magnitude(rollout.initial(s).layout(), rollout.initial(s).base()));
}

void Simulation::Impl::require_size(Values values, std::string_view what) const {
  const dpde_scene& scene = engine.scene();
  if (scene.task == nullptr)
    throw Error(ErrorKind::input, fmt::format("scene {} was compiled without a task: it has no unknowns", scene.name));
  if (values.size() == engine.unknown_count()) return;
  throw Error(ErrorKind::input, fmt::format("the unknowns of task {} are {} values, the {} has {}", scene.task,
                                            engine.unknown_count(), what, values.size()));
}

void Simulation::Impl::product(Values direction, Target to, Curvature curvature) {
  require_size(direction, "direction");
  require_size(Values(to), "product");
  engine.products(curvature);  // throws if there are none
  begin_objective();
  engine.product(direction, to, curvature);
}

Optimised Simulation::Impl::optimise(const OptimiserCallback& progress, int iterations) {
  engine.objective();  // throws if there is no task
  const dpde_optimiser& optimiser = engine.scene().optimiser;
  const Curvature curvature = optimiser.gauss_newton != 0 ? Curvature::gauss_newton : Curvature::full;
  if (optimiser.method == DPDE_NEWTON_CG) engine.products(curvature);  // throws before anything runs
  Eigen::VectorXd start(static_cast<Eigen::Index>(engine.unknown_count()));
  const std::span<double> first(start.data(), engine.unknown_count());
  for (const Engine::Unknown& unknown : engine.unknowns()) engine.values_of(unknown, unknown.part_of(first));
  bool was_stopped = false, is_first = true;
  const Objective loss = [&](const Eigen::VectorXd& x, Eigen::VectorXd& slope) {
    if (was_stopped) return std::numeric_limits<double>::quiet_NaN();  // otherwise a line search would try again
    engine.set_unknowns(values_in(x));
    const double value = is_first ? gradient() : gradient_or_none();
    is_first = false;
    was_stopped = engine.was_stopped();
    std::ranges::copy(gradient_values, slope.data());
    return value;
  };
  const HessianProduct hessian = [&](const Eigen::VectorXd& x, const Eigen::VectorXd& v, Eigen::VectorXd& result) {
    engine.set_unknowns(values_in(x));
    try {
      product(values_in(v), {result.data(), static_cast<std::size_t>(result.size())}, curvature);
    } catch (const NoSolution&) {
      if (x == start) throw;
      result.setConstant(std::numeric_limits<double>::quiet_NaN());
    }
    was_stopped = was_stopped || engine.was_stopped();
  };
  const IterationObserver observer = [&](const Iteration& now) {
    return !progress || progress({now.iteration, now.loss, now.gradient_norm});
  };
  std::vector<UnknownScale> parts;
  for (const Engine::Unknown& unknown : engine.unknowns())
    parts.push_back({static_cast<Eigen::Index>(unknown.offset), static_cast<Eigen::Index>(unknown.size)});
  const Bounds bounds = engine.bounds();
  const OptimiseResult done =
      minimise_scaled(method_of(optimiser), loss, hessian, start, iterations > 0 ? iterations : optimiser.iterations,
                      scales_of(start, std::move(parts), bounds), observer, bounds)
          .result;
  engine.set_unknowns(values_in(done.x));
  return {was_stopped ? StopReason::observer : done.reason,
          done.loss,
          done.losses,
          done.iterations,
          done.evaluations,
          done.hessian_products};
}

double Simulation::loss() {
  const Running running(impl_->is_running);
  const double loss = impl_->explained([&] {
    impl_->begin_objective();
    return impl_->engine.loss();
  });
  if (!impl_->engine.was_stopped() && !std::isfinite(loss)) impl_->refuse(impl_->engine.objective(), "the loss");
  if (!impl_->engine.was_stopped()) impl_->look_for_growth_of_losses();
  return loss;
}

double Simulation::gradient() {
  const Running running(impl_->is_running);
  const double loss = impl_->explained([&] { return impl_->gradient(); });
  if (impl_->engine.was_stopped()) return loss;
  if (!std::isfinite(loss)) impl_->refuse(impl_->engine.objective(), "the loss");
  for (const Engine::Unknown& unknown : impl_->engine.unknowns()) {
    if (!all_finite(unknown.part_of(gradient_vector())))
      impl_->refuse(impl_->engine.objective(), fmt::format("the gradient of the loss by {}", unknown.name));
  }
  impl_->look_for_growth_of_losses();
  return loss;
}

std::span<const double> Simulation::gradient_vector() const { return impl_->gradient_values; }

std::span<const double> Simulation::gradient_of(std::string_view name) const {
  return impl_->unknown_named(name).part_of(gradient_vector());
}

void Simulation::watch_gradients(GradientCallback progress, int every) {
  impl_->engine.watch_gradients(std::move(progress), every);
}

std::vector<double> Simulation::value_of(std::string_view name) {
  const Engine::Unknown& unknown = impl_->unknown_named(name);
  std::vector<double> values(unknown.size);
  impl_->engine.values_of(unknown, values);
  return values;
}

std::vector<double> Simulation::unknown_values() {
  std::vector<double> values(impl_->engine.unknown_count());
  for (const Engine::Unknown& unknown : impl_->engine.unknowns())
    impl_->engine.values_of(unknown, unknown.part_of(std::span<double>(values)));
  return values;
}

void Simulation::set_unknowns(Values values) {
  impl_->require_size(values, "vector of values");
  impl_->engine.set_unknowns(values);
}

std::vector<double> Simulation::hessian_vector(Values direction, Curvature curvature) {
  std::vector<double> product(direction.size());
  hessian_vector(direction, product, curvature);
  return product;
}

void Simulation::hessian_vector(Values direction, Target product, Curvature curvature) {
  const Running running(impl_->is_running);
  impl_->explained([&] { impl_->product(direction, product, curvature); });
  if (!impl_->engine.was_stopped() && !all_finite(product))
    impl_->refuse(impl_->engine.products(curvature), "the product with the Hessian");
}

Optimised Simulation::optimise(const OptimiserCallback& progress, int iterations) {
  const Running running(impl_->is_running);
  return impl_->explained([&] { return impl_->optimise(progress, iterations); });
}

}  // namespace dpde
