// SPDX-License-Identifier: Apache-2.0
// Runs until steady, and the gradient there by the implicit function theorem: where x = S(x, p) for the step S,
//
//   (I - S_x^T)*lambda = x_bar,   p_bar += S_p^T*lambda
//
// with x_bar of the losses. The adjoint of one step gives S_x^T*lambda and S_p^T*lambda; the linear system is solved by
// GMRES, so that no trajectory is stored or gone back. Rates are what the tangent step leaves as they are,
// v = S_x*v + S_p*p_dot, by the same method.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "dpde/runtime/error.h"
#include "dpde/runtime/unsolved.h"
#include "rollout_impl.h"
#include "solve/gmres.h"

namespace dpde {
namespace {

constexpr int steps_between_looks = 64;                                    // for values that are not finite
constexpr double most_left = 1e-12, most_left_single = 1e-5;               // of linear systems, relative
constexpr double most_by_rounding = 1e-8, most_by_single_rounding = 1e-3;  // what is more is no rounding
constexpr int least_vectors = 8, most_vectors = 60;                        // of GMRES between restarts
constexpr int more_terms = 4, most_stalls = 4;

/// Somebody wants no more while a linear system is solved.
struct StoppedBetweenProducts {};

}  // namespace

/// One step, or one product with a step's derivative, more; sets result.stopped, and is false, where somebody wants no
/// more. Nobody knows how many there are: at least those that the run may take.
bool Rollout::Impl::goes_on_to_steady(int state, bool is_back) {
  const int64_t total = std::max<int64_t>(setup.steps, steps_worked + 2);
  result.stopped = stopping() || !go_on(state, 1, total, is_back);
  return !result.stopped;
}

/// Of all states but rates, a unit of time.
double Rollout::Impl::largest_change(const StateBuffer& from, const StateBuffer& to) const {
  double change = 0;
  for (size_t s = 0; s < to.size(); ++s) {
    if (is_rate[s]) continue;
    const double of_state = largest_difference(setup.layout, from[s], to[s], INFINITY);
    change = std::isnan(of_state) ? of_state : std::max(change, of_state);
  }
  return change / setup.dt;
}

/// Reads no further than to the first row that is not.
bool Rollout::Impl::is_still(const StateBuffer& from, const StateBuffer& to) const {
  const double enough = setup.steady * setup.dt;
  for (size_t s = 0; s < to.size(); ++s) {
    if (!is_rate[s] && !(largest_difference(setup.layout, from[s], to[s], enough) <= enough)) return false;
  }
  return true;
}

/// From the initial state; `current` is then where it ends. Nothing when stopped, which result.stopped tells, or where
/// values are not finite.
std::optional<Steady> Rollout::Impl::run_to_steady() {
  result.stopped = stopping();
  if (result.stopped) return std::nullopt;
  if (!setup.rates.empty()) return find_steady_rates();
  double change = 0;
  for (int n = 0; n < setup.steps; ++n) {
    const int next = free_buffer(current, current);
    const StateBuffer &from = buffers[static_cast<size_t>(current)], &to = buffers[static_cast<size_t>(next)];
    step(n, from, to);
    current = next;
    if (!goes_on_to_steady(n + 1, false)) return std::nullopt;
    if (is_still(from, to)) return Steady{true, n + 1, time(n + 1), largest_change(from, to)};
    const bool is_last = n + 1 == setup.steps;
    if ((is_last || n % steps_between_looks == steps_between_looks - 1) && find_blow_up(n + 1, to)) return std::nullopt;
    if (is_last) change = largest_change(from, to);
  }
  throw Unsolved(
      {.what = UnsolvedFacts::What::steady,
       .text = fmt::format("after {} steps (t = {:.6g}) the state is not steady: it changes by {:.3g} a unit of time, "
                           "more than {:.3g}",
                           setup.steps, time(setup.steps), change, setup.steady),
       .advice = [] { return std::string("let it run longer, or take a larger tolerance"); }});
}

/// x - step(x) = b for a linear `step`, from the guess x. Neumann's sum b + step(b) + step(step(b)) + ..., cut off, is
/// the preconditioner, of more terms where GMRES stalls. False when stopped.
bool Rollout::Impl::solve_fixed_point(const VectorFunction& step, std::span<const double> b, std::span<double> x,
                                      bool is_back, SteadyAdjoint& report) {
  const bool is_single = setup.layout.real == DPDE_F32;
  const double tolerance = is_single ? most_left_single : most_left, rounding = is_single ? 0x1p-23 : 0x1p-52;
  const auto fits = static_cast<int>(std::min<int64_t>(
      setup.checkpoint_bytes / static_cast<int64_t>(sizeof(double) * std::max<size_t>(b.size(), 1)), most_vectors));
  const int vectors = std::max(fits, least_vectors);
  std::vector<double> image(b.size());
  const auto apply = [&](std::span<const double> v, std::span<double> to) {
    if (!goes_on_to_steady(last_step(), is_back)) throw StoppedBetweenProducts();
    ++report.products;
    step(v, to);
  };
  const VectorFunction multiply = [&](std::span<const double> v, std::span<double> to) {
    apply(v, to);
    for (size_t i = 0; i < v.size(); ++i) to[i] = v[i] - to[i];
  };
  int terms = 1, stalls = 0;
  const VectorFunction precondition = [&](std::span<const double> r, std::span<double> z) {
    std::ranges::copy(r, z.begin());
    for (int k = 1; k < terms; ++k) {
      apply(z, image);
      for (size_t i = 0; i < r.size(); ++i) z[i] = r[i] + image[i];
    }
  };
  Gmres gmres(multiply, precondition, tolerance, std::numeric_limits<int>::max(), vectors);
  gmres.resize(b.size());
  report.bytes = static_cast<int64_t>((gmres.vectors() + 3) * b.size() * sizeof(double));
  for (double before = INFINITY; stalls < most_stalls; terms *= more_terms) {
    try {
      report.residual = gmres.solve(b, x).residual;
    } catch (const StoppedBetweenProducts&) {
      return false;
    }
    const double by_rounding = 16 * rounding * norm(x) / norm(b);
    report.bound = std::max(tolerance, std::min(by_rounding, is_single ? most_by_single_rounding : most_by_rounding));
    if (report.residual <= report.bound) return true;
    stalls += report.residual < 0.1 * before ? 0 : 1;
    before = report.residual;
  }
  throw Unsolved(
      {.what = UnsolvedFacts::What::steady,
       .text = fmt::format("the derivative of the steady state is not found: after {} products {:.3g} of the right "
                           "side is left, more than {:.3g}",
                           report.products, report.residual, report.bound),
       .method = "gmres",
       .residual = report.residual,
       .advice = [] {
         return std::string(
             "where a sum is conserved the steady state depends on where the run begins: then leave "
             "until steady out");
       }});
}

/// S(x) - x, all states one behind the other.
std::vector<double> Rollout::Impl::unrest_of(const StateBuffer& state) {
  const auto cells = static_cast<size_t>(cell_count(setup.layout));
  const StateBuffer& next = buffers[static_cast<size_t>(free_buffer(current, current))];
  step(last_step(), state, next);
  std::vector<double> unrest(state.size() * cells), before(cells);
  for (size_t s = 0; s < state.size(); ++s) {
    const std::span<double> own = std::span(unrest).subspan(s * cells, cells);
    copy_out(setup.layout, next[s], own);
    copy_out(setup.layout, state[s], std::span(before));
    for (size_t i = 0; i < cells; ++i) own[i] -= before[i];
  }
  return unrest;
}

/// bars[bar] becomes lambda, unless stopped. To first order the state comes to rest at x + (I - S_x)^-1*(S(x) - x),
/// where the loss is larger by lambda*(S(x) - x).
SteadyAdjoint Rollout::Impl::solve_adjoint(const StateBuffer& state, std::span<const double> unrest) {
  const auto cells = static_cast<size_t>(cell_count(setup.layout)), size = state.size() * cells;
  const auto write = [&](std::span<const double> v) {
    for (size_t s = 0; s < state.size(); ++s) copy_in(setup.layout, bars[bar][s], v.subspan(s * cells, cells));
  };
  const auto read = [&](std::span<double> v) {
    for (size_t s = 0; s < state.size(); ++s) copy_out(setup.layout, bars[bar][s], v.subspan(s * cells, cells));
  };
  std::vector<double> x_bar(size), lambda(size);
  read(x_bar);
  SteadyAdjoint report;
  if (norm(x_bar) == 0) return report;
  {
    const WithoutSums products_alone(*this);
    const auto step_back = [&](std::span<const double> v, std::span<double> image) {
      write(v);
      reverse_step(last_step(), state);
      read(image);
    };
    if (!solve_fixed_point(step_back, x_bar, lambda, true, report)) return report;
  }
  for (size_t i = 0; i < size; ++i) report.unsteady += lambda[i] * unrest[i];
  std::vector<double>& values = x_bar;
  for (size_t s = 0; s < state.size(); ++s)
    copy_out(setup.layout, state[s], std::span(values).subspan(s * cells, cells));
  for (size_t i = 0; i < size; ++i) report.scale += std::abs(lambda[i] * values[i]);
  write(lambda);
  return report;
}

/// The state is steady as it is given. Nothing when stopped.
std::optional<Steady> Rollout::Impl::find_steady_rates() {
  const auto cells = static_cast<size_t>(cell_count(setup.layout));
  const StateBuffer &from = buffers[1], &to = buffers[2];
  for (size_t s = 0; s < from.size(); ++s) copy_all(setup.layout, from[s], buffers.front()[s]);
  std::vector<size_t> rates;
  for (size_t s = 0; s < from.size(); ++s) {
    if (is_rate[s]) rates.push_back(s);
  }
  const auto write = [&](std::span<const double> v) {
    for (size_t i = 0; i < rates.size(); ++i) copy_in(setup.layout, from[rates[i]], v.subspan(i * cells, cells));
    forward->program.bind_states(from);
    for (const int field : forward->program.states) forward->program.executor.prepare(field);
  };
  const auto apply = [&](std::span<const double> v, std::span<double> image) {
    write(v);
    step(last_step(), from, to);
    for (size_t i = 0; i < rates.size(); ++i) copy_out(setup.layout, to[rates[i]], image.subspan(i * cells, cells));
  };
  std::vector<double> of_params(rates.size() * cells), solution(of_params.size());
  apply(solution, of_params);
  const Steady steady{true, setup.steps, time(setup.steps), largest_change(from, to)};
  const auto linear = [&](std::span<const double> v, std::span<double> image) {
    apply(v, image);
    for (size_t i = 0; i < image.size(); ++i) image[i] -= of_params[i];
  };
  SteadyAdjoint report;
  if (norm(of_params) > 0 && !solve_fixed_point(linear, of_params, solution, false, report)) return std::nullopt;
  write(solution);
  current = 1;
  return steady;
}

/// False when stopped; the loss is not a number where the run is not finite.
bool Rollout::Impl::run_steady_gradient() {
  const std::optional<Steady> steady = run_to_steady();
  result.steady.reset();
  if (!steady) loss_value = std::numeric_limits<double>::quiet_NaN();
  if (!steady) return !result.stopped;
  const StateBuffer& state = buffers[static_cast<size_t>(current)];
  const std::vector<double> unrest = unrest_of(state);
  add_losses(events_at(setup.steps), steady->step, state);
  forward_done();
  seed_end(state, steady->step);
  result.steady = solve_adjoint(state, unrest);
  result.steady->state = *steady;
  if (result.stopped) return false;
  reverse_step(last_step(), state);
  for (void* of_state : bars[bar]) fill_all(setup.layout, of_state, 0.0);  // wherever the run has begun
  return true;
}

}  // namespace dpde
