// SPDX-License-Identifier: Apache-2.0
#include "run/steady_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "dpde/runtime/layout.h"
#include "dpde/runtime/unsolved.h"
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

SteadyRun::SteadyRun(const ResolvedSetup& setup, const StepInputs& inputs, States& states, Stepper& stepper,
                     RunWatch& watch)
    : setup_(setup), inputs_(inputs), states_(states), stepper_(stepper), watch_(watch) {
  for (const ValueId id : states.ids().now) is_rate_.push_back(setup.is_rate(id) ? 1 : 0);
}

/// One step, or one product with a step's derivative, more; false where somebody wants no more.
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
    if (is_still(from, to)) return Steady{true, n + 1, inputs_.time(n + 1), largest_change(from, to)};
    const bool is_last = n + 1 == setup_.steps;
    if ((is_last || n % steps_between_looks == steps_between_looks - 1) &&
        states_.find_blow_up(n + 1, inputs_.time(n + 1), to))
      return std::nullopt;
    if (is_last) change = largest_change(from, to);
  }
  throw not_steady({false, setup_.steps, inputs_.time(setup_.steps), change}, setup_.steady);
}

/// x - step(x) = b for a linear `step`, from the guess x. Neumann's sum b + step(b) + step(step(b)) + ..., cut off, is
/// the preconditioner, of more terms where GMRES stalls. False when stopped.
bool SteadyRun::solve_fixed_point(const VectorFunction& step, std::span<const double> b, std::span<double> x,
                                  bool is_back, SteadyAdjoint& report) {
  const bool is_single = setup_.layout.real == DPDE_F32;
  const double tolerance = is_single ? most_left_single : most_left, rounding = is_single ? 0x1p-23 : 0x1p-52;
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

std::vector<double> SteadyRun::unrest() {
  const auto cells = static_cast<size_t>(cell_count(setup_.layout));
  const StateBuffer &state = states_.now(), &next = states_.buffer(states_.free_buffer());
  stepper_.step(last_step(), state, next);
  std::vector<double> unrest(state.size() * cells), before(cells);
  for (size_t s = 0; s < state.size(); ++s) {
    const std::span<double> own = std::span(unrest).subspan(s * cells, cells);
    copy_out(setup_.layout, next[s], own);
    copy_out(setup_.layout, state[s], std::span(before));
    for (size_t i = 0; i < cells; ++i) own[i] -= before[i];
  }
  return unrest;
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
  {
    const WithoutSums products_alone(back.adjoint);
    const auto step_back = [&](std::span<const double> v, std::span<double> image) {
      write(v);
      back.adjoint.reverse(last_step(), state, true);
      read(image);
    };
    if (!solve_fixed_point(step_back, x_bar, lambda, true, report)) return report;
  }
  for (size_t i = 0; i < size; ++i) report.unsteady += lambda[i] * unrest[i];
  std::vector<double>& values = x_bar;
  for (size_t s = 0; s < state.size(); ++s)
    copy_out(setup_.layout, state[s], std::span(values).subspan(s * cells, cells));
  for (size_t i = 0; i < size; ++i) report.scale += std::abs(lambda[i] * values[i]);
  write(lambda);
  return report;
}

/// The state is steady as it is given. Nothing when stopped.
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
  if (norm(of_params) > 0 && !solve_fixed_point(linear, of_params, solution, false, report)) return std::nullopt;
  write(solution);
  states_.go_to(1);
  return steady;
}

}  // namespace dpde
