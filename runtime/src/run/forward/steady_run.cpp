// SPDX-License-Identifier: Apache-2.0
#include "run/forward/steady_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "dpde/runtime/layout.h"
#include "dpde/runtime/unsolved.h"
#include "solve/operator/gmres.h"

namespace dpde {
namespace {

constexpr int steps_between_looks = 64;              // steps between checks for values that are not finite
constexpr int least_vectors = 8, most_vectors = 60;  // of GMRES between restarts
constexpr int more_terms = 4, most_stalls = 4;
constexpr int most_newton = 8;
constexpr double at_rest = 1e-3;  // factor by which the residual must fall

/// Thrown when the run is stopped within a linear solve.
struct StoppedBetweenProducts {};

Unsolved no_rest() {
  return Unsolved({.what = UnsolvedFacts::What::steady, .text = "no state at rest is found nearby"});
}

LinearAccuracy accuracy_of(const dpde_layout& layout) {
  return layout.real == DPDE_F32 ? LinearAccuracy{1e-5, 0x1p-23, 1e-3} : LinearAccuracy{1e-12, 0x1p-52, 1e-8};
}

}  // namespace

SteadyRun::SteadyRun(const ResolvedSetup& setup, const StepInputs& inputs, States& states, Stepper& stepper,
                     RunWatch& watch)
    : setup_(setup), inputs_(inputs), states_(states), stepper_(stepper), watch_(watch) {
  for (const ValueId id : states.ids().now) is_rate_.push_back(setup.is_rate(id) ? 1 : 0);
}

/// Counts a step, or a product with a step's derivative; returns false if the run is to stop.
bool SteadyRun::goes_on(int state, bool is_back) {
  was_stopped_ = watch_.stopping() || !watch_.go_on_open(inputs_.time(state), is_back);
  return !was_stopped_;
}

double SteadyRun::largest_change(const StateBuffer& from, const StateBuffer& to) const {
  double change = 0;
  for (size_t s = 0; s < to.size(); ++s) {
    if (is_rate_[s]) continue;
    const double of_state = largest_difference(setup_.layout, from[s], to[s], INFINITY);
    change = std::isnan(of_state) ? of_state : std::max(change, of_state);
  }
  return change / setup_.dt;
}

bool SteadyRun::is_still(const StateBuffer& from, const StateBuffer& to) const {
  const double enough = setup_.steady * setup_.dt;
  for (size_t s = 0; s < to.size(); ++s) {
    if (!is_rate_[s] && !(largest_difference(setup_.layout, from[s], to[s], enough) <= enough)) return false;
  }
  return true;
}

Unsolved not_steady(const Steady& last, double enough) {
  return Unsolved(
      {.what = UnsolvedFacts::What::steady,
       .text = fmt::format("after {} steps (t = {:.6g}) the state is not steady: it changes by {:.3g} a unit of time, "
                           "more than {:.3g}",
                           last.step, last.t, last.change, enough),
       .advice = [] { return std::string("let it run longer, or take a larger tolerance"); }});
}

std::optional<Steady> SteadyRun::run() {
  was_stopped_ = watch_.stopping();
  if (was_stopped_) return std::nullopt;
  if (!setup_.rates.empty()) return find_rates();
  double change = 0;
  for (int n = 0; n < setup_.steps; ++n) {
    const int next = states_.free_buffer();
    const StateBuffer &from = states_.now(), &to = states_.buffer(next);
    stepper_.step(n, from, to);
    states_.go_to(next);
    if (!goes_on(n + 1, false)) return std::nullopt;
    if (is_still(from, to)) {
      const Steady steady{true, n + 1, inputs_.time(n + 1), largest_change(from, to)};
      return ends_at_rest_ && !move_to_rest() ? std::nullopt : std::optional(steady);
    }
    const bool is_last = n + 1 == setup_.steps;
    if ((is_last || n % steps_between_looks == steps_between_looks - 1) &&
        states_.find_blow_up(n + 1, inputs_.time(n + 1), to))
      return std::nullopt;
    if (is_last) change = largest_change(from, to);
  }
  throw not_steady({false, setup_.steps, inputs_.time(setup_.steps), change}, setup_.steady);
}

/// Solves x - step(x) = b for a linear `step`, from the guess x, by GMRES. Preconditioner: the truncated Neumann series
/// b + step(b) + step(step(b)) + ..., with more terms if GMRES stalls. Returns false when stopped.
bool SteadyRun::solve_fixed_point(const VectorFunction& step, std::span<const double> b, std::span<double> x,
                                  bool is_back, const LinearAccuracy& accuracy, SteadyAdjoint& report) {
  const auto fits = static_cast<int>(std::min<int64_t>(
      setup_.checkpoint_bytes / static_cast<int64_t>(sizeof(double) * std::max<size_t>(b.size(), 1)), most_vectors));
  const int vectors = std::max(fits, least_vectors);
  std::vector<double> image(b.size());
  const auto apply = [&](std::span<const double> v, std::span<double> to) {
    if (!goes_on(last_step(), is_back)) throw StoppedBetweenProducts();
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
  Gmres gmres(multiply, precondition, accuracy.tolerance, std::numeric_limits<int>::max(), vectors);
  gmres.resize(b.size());
  report.bytes = static_cast<int64_t>((gmres.vectors() + 3) * b.size() * sizeof(double));
  for (double before = INFINITY; stalls < most_stalls; terms *= more_terms) {
    try {
      report.residual = gmres.solve(b, x).residual;
    } catch (const StoppedBetweenProducts&) {
      return false;
    }
    const double by_rounding = 16 * accuracy.rounding * norm(x) / norm(b);
    report.bound = std::max(accuracy.tolerance, std::min(by_rounding, accuracy.most_by_rounding));
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

std::vector<double> SteadyRun::values_of(const StateBuffer& state) const {
  const auto cells = static_cast<size_t>(cell_count(setup_.layout));
  std::vector<double> values(state.size() * cells);
  for (size_t s = 0; s < state.size(); ++s)
    copy_out(setup_.layout, state[s], std::span(values).subspan(s * cells, cells));
  return values;
}

/// Writes values to the current state, and fills halos.
void SteadyRun::set(std::span<const double> values) {
  const auto cells = static_cast<size_t>(cell_count(setup_.layout));
  const StateBuffer& state = states_.now();
  for (size_t s = 0; s < state.size(); ++s) copy_in(setup_.layout, state[s], values.subspan(s * cells, cells));
  stepper_.program().bind_states(state);
  stepper_.program().prepare_states();
}

std::vector<double> SteadyRun::unrest() {
  const StateBuffer &state = states_.now(), &next = states_.buffer(states_.free_buffer());
  stepper_.step(last_step(), state, next);
  std::vector<double> unrest = values_of(next);
  add_multiple(-1, values_of(state), unrest);
  return unrest;
}

/// Typical size of each state's values, since states have different units.
std::vector<double> SteadyRun::sizes_of(std::span<const double> values, std::span<const double> otherwise) const {
  const auto cells = static_cast<size_t>(cell_count(setup_.layout));
  const auto largest = [&](std::span<const double> all, size_t s) {
    double most = 0;
    for (const double value : all.subspan(s * cells, cells)) most = std::max(most, std::abs(value));
    return most;
  };
  std::vector<double> sizes(values.size(), 1);
  for (size_t s = 0; s < states_.now().size(); ++s) {
    double size = largest(values, s);
    if (size == 0) size = largest(otherwise, s);
    if (size > 0) std::fill_n(sizes.begin() + static_cast<std::ptrdiff_t>(s * cells), cells, size);
  }
  return sizes;
}

/// Newton's method for S(x) = x, each state scaled by its size; S_x*v is a central difference of steps (Knoll and Keyes
/// 2004). Uses at most as many products as the adjoint of the steady state did, plus those of one GMRES cycle. Returns
/// false when stopped.
bool SteadyRun::move_to_rest() {
  const LinearAccuracy accuracy = accuracy_of(setup_.layout);
  std::vector<double> x = values_of(states_.now()), left = unrest(), change(x.size()), beside(x.size());
  const std::vector<double> sizes = sizes_of(x, left);
  const auto divide = [&](std::span<double> values) {
    for (size_t i = 0; i < values.size(); ++i) values[i] /= sizes[i];
  };
  const auto unrest_at = [&](std::span<const double> scaled) {
    for (size_t i = 0; i < scaled.size(); ++i) beside[i] = scaled[i] * sizes[i];
    set(beside);
    std::vector<double> found = unrest();
    divide(found);
    return found;
  };
  const auto unrest_beside = [&](double distance, std::span<const double> v) {
    std::vector<double> place = x;
    add_multiple(distance, v, place);
    return unrest_at(place);
  };
  divide(x);
  divide(left);
  const int most_products = products_of_adjoint_ + most_vectors;
  const double enough = at_rest * norm(left);
  SteadyAdjoint report;
  for (int n = 0; norm(left) > std::max(enough, 16 * accuracy.rounding * norm(x)); ++n) {
    if (n == most_newton) throw no_rest();
    const double length = accuracy.length() * (norm(x) + norm(left));
    const auto derivative = [&](std::span<const double> v, std::span<double> image) {
      if (report.products > most_products) throw no_rest();
      const double distance = norm(v) == 0 ? 1 : length / norm(v);
      const std::vector<double> above = unrest_beside(distance, v), below = unrest_beside(-distance, v);
      for (size_t i = 0; i < image.size(); ++i) image[i] = v[i] + (above[i] - below[i]) / (2 * distance);
    };
    std::ranges::fill(change, 0);
    if (!solve_fixed_point(derivative, left, change, false, accuracy.of_differences(0.1 * at_rest), report))
      return false;
    add_multiple(1, change, x);
    left = unrest_at(x);
  }
  return true;
}

SteadyAdjoint SteadyRun::solve_adjoint(WayBack& back, std::span<const double> unrest) {
  const StateBuffer& state = states_.now();
  const auto cells = static_cast<size_t>(cell_count(setup_.layout)), size = state.size() * cells;
  const auto write = [&](std::span<const double> v) {
    for (size_t s = 0; s < state.size(); ++s) copy_in(setup_.layout, back.bars.seeds()[s], v.subspan(s * cells, cells));
  };
  const auto read = [&](std::span<double> v) {
    for (size_t s = 0; s < state.size(); ++s)
      copy_out(setup_.layout, back.bars.seeds()[s], v.subspan(s * cells, cells));
  };
  std::vector<double> x_bar(size), lambda(size);
  read(x_bar);
  SteadyAdjoint report;
  if (norm(x_bar) == 0) return report;
  const std::vector<double> values = values_of(state);
  for (size_t i = 0; i < size; ++i) report.scale += std::abs(x_bar[i] * values[i]);
  {
    const WithoutSums products_alone(back.adjoint);
    const auto step_back = [&](std::span<const double> v, std::span<double> image) {
      write(v);
      back.adjoint.reverse(last_step(), state, true);
      read(image);
    };
    if (!solve_fixed_point(step_back, x_bar, lambda, true, accuracy_of(setup_.layout), report)) return report;
  }
  for (size_t i = 0; i < size; ++i) report.unsteady += lambda[i] * unrest[i];
  products_of_adjoint_ = report.products;
  write(lambda);
  return report;
}

/// Solves for the rates; the state must be steady. Returns nothing when stopped.
std::optional<Steady> SteadyRun::find_rates() {
  const auto cells = static_cast<size_t>(cell_count(setup_.layout));
  const StateBuffer &from = states_.buffer(1), &to = states_.buffer(2);
  for (size_t s = 0; s < from.size(); ++s) copy_all(setup_.layout, from[s], states_.first()[s]);
  std::vector<size_t> rates;
  for (size_t s = 0; s < from.size(); ++s) {
    if (is_rate_[s]) rates.push_back(s);
  }
  const auto write = [&](std::span<const double> v) {
    for (size_t i = 0; i < rates.size(); ++i) copy_in(setup_.layout, from[rates[i]], v.subspan(i * cells, cells));
    stepper_.program().bind_states(from);
    stepper_.program().prepare_states();
  };
  const auto apply = [&](std::span<const double> v, std::span<double> image) {
    write(v);
    stepper_.step(last_step(), from, to);
    for (size_t i = 0; i < rates.size(); ++i) copy_out(setup_.layout, to[rates[i]], image.subspan(i * cells, cells));
  };
  std::vector<double> of_params(rates.size() * cells), solution(of_params.size());
  apply(solution, of_params);
  const Steady steady{true, setup_.steps, inputs_.time(setup_.steps), largest_change(from, to)};
  const auto linear = [&](std::span<const double> v, std::span<double> image) {
    apply(v, image);
    for (size_t i = 0; i < image.size(); ++i) image[i] -= of_params[i];
  };
  SteadyAdjoint report;
  const LinearAccuracy accuracy = accuracy_of(setup_.layout);
  if (norm(of_params) > 0 && !solve_fixed_point(linear, of_params, solution, false, accuracy, report))
    return std::nullopt;
  write(solution);
  states_.go_to(1);
  return steady;
}

}  // namespace dpde
