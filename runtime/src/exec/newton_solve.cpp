// SPDX-License-Identifier: Apache-2.0
#include "exec/newton_solve.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "base/processor_watch.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/unsolved.h"
#include "solve/operator/finite.h"

namespace dpde {

namespace {

constexpr int most_newton_steps = 50, most_halvings = 8;
/// In units of rounding. An image takes about 32 operations (a difference of order 8 along three axes has 27 terms),
/// each with an error of half a unit of the unknowns' contribution.
constexpr double roundings = 16;
constexpr int moves = 4;         // random perturbations of the unknowns: cancellation in one of them is not in all
constexpr int most_growing = 1;  // steps longer than the previous one: it may converge to another solution

/// 2-norm, scaled so that squares of large numbers do not overflow.
double length(std::span<const double> values) {
  double sum = 0, largest = 0;
  for (const double value : values) largest = std::max(largest, std::abs(value));
  if (largest == 0) return 0;
  for (const double value : values) sum += (value / largest) * (value / largest);
  return largest * std::sqrt(sum);
}

/// A pseudo-random sign without a spatial pattern: a hash (S. Vigna's splitmix64).
double arbitrary_sign(std::uint64_t i) {
  std::uint64_t z = (i + 1) * 0x9e3779b97f4a7c15U;
  z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
  return ((z ^ (z >> 31U)) & 1U) == 0 ? 1 : -1;
}

}  // namespace

NewtonSolve::NewtonSolve(const dpde_solve& solve, const dpde_program& program, const dpde_layout& given,
                         SolverShelf& shelf)
    : names_(names_of_unknowns(solve, program)),
      tolerance_(std::max(solve.tolerance, 64 * rounding_of(given))),
      loose_(std::sqrt(rounding_of(given))),
      rounding_(rounding_of(given)),
      nothing_((given.real == DPDE_F32 ? 0x1p-126 : 0x1p-1022) / rounding_of(given)),
      twice_rounded_(0x1p10 * rounding_of(given) * rounding_of(given)) {
  if (solve.step == nullptr) return;  // the program is run by an interpreter
  const dpde_layout layout = with_three_axes(given);
  images_ = {solve.images, solve.count, layout};
  rights_ = {solve.rights, solve.count, layout};
  unknowns_ = {solve.unknowns, solve.count, layout};
  step_rights_ = {solve.step->rights, solve.count, layout};
  step_unknowns_ = {solve.step->unknowns, solve.count, layout};
  note_ = &shelf.add_note(names_);
  note_->method = "newton";
  note_->reason = "not linear: Newton's method with compiled tangents";
  step_ = CoupledSolve(*solve.step, program, given, shelf.add_note(names_of_unknowns(*solve.step, program)));
  for (auto* values : {&right_, &x_, &next_, &left_, &change_, &kept_}) values->assign(unknowns_.size(), 0.0);
  for (auto* of_fields : {&changes_, &moved_}) of_fields->reserve(unknowns_.size() / unknowns_.cells());
}

std::vector<OwnedMemory> NewtonSolve::memory(const std::string& owner) const {
  std::vector<OwnedMemory> owned = step_.memory(owner);
  if (!owned.empty()) owned.front().kept += static_cast<std::int64_t>(6 * unknowns_.size() * sizeof(double));
  return owned;
}

void NewtonSolve::run(void* const* fields, const double* params, const std::function<void()>& apply,
                      const std::function<void()>& apply_step) {
  if (x_.empty())
    throw Error(ErrorKind::machine, fmt::format("newton for {}: the program was compiled without its step", names_));
  const ProcessorWatch solving(note_->seconds);
  rights_.read(fields, right_);
  x_ = right_;
  unknowns_.write(fields, x_);
  if (!are_finite(right_)) return;  // the run has blown up: its caller finds it in the result
  double left = distance(fields, apply), last = std::numeric_limits<double>::infinity();
  changes_.assign(x_.size() / unknowns_.cells(), std::numeric_limits<double>::infinity());
  int growing = 0;
  for (int k = 0; k < most_newton_steps; ++k) {
    const bool wanders = growing > most_growing;
    if (wanders && std::isfinite(left) && is_rounding_left(fields, apply)) return note(k);
    if (!std::isfinite(left) || wanders) fail(k, left);
    solve_step(fields, params, apply_step, k);
    const double change = relative_change();
    if (change > loose_ && change > last) ++growing;
    left = move(fields, apply, left, change > loose_);
    if (change <= tolerance_ || (change <= loose_ && change > last / 4)) return note(k + 1);
    last = change;
  }
  if (std::isfinite(left) && is_rounding_left(fields, apply)) return note(most_newton_steps);
  fail(most_newton_steps, left);
}

void NewtonSolve::note(int steps) {
  ++note_->solves;
  note_->iterations += steps;
  note_->most_iterations = std::max(note_->most_iterations, steps);
}

/// Norm of the residual (right sides - images), which is stored in `left_`.
double NewtonSolve::distance(void* const* fields, const std::function<void()>& apply) {
  apply();
  images_.read(fields, left_);
  for (std::size_t i = 0; i < left_.size(); ++i) left_[i] = right_[i] - left_[i];
  return length(left_);
}

/// The largest relative change of a field. The rounding of a large field perturbs the residual of small ones, so their
/// changes stagnate at that level. Changes below this level that no longer decrease do not count.
double NewtonSolve::relative_change() {
  const double rounded = twice_rounded_ * std::max(largest_size(x_), largest_size(right_));
  double most = 0;
  for (std::size_t first = 0, field = 0; first < x_.size(); first += unknowns_.cells(), ++field) {
    const auto part = [&](const std::vector<double>& values) {
      return std::span(values).subspan(first, unknowns_.cells());
    };
    const double change = largest_size(part(change_)),
                 size = std::max(largest_size(part(x_)), largest_size(part(right_)));
    const double before = std::exchange(changes_[field], change);
    const bool is_rounding = change <= rounded && change >= before;
    if (change > nothing_ && !is_rounding) most = std::max(most, size > 0 ? change / size : 1.0);
    if (std::isnan(change)) most = std::numeric_limits<double>::infinity();
  }
  return most;
}

/// Whether the residual is rounding: in each field at most `roundings` times the change of its image if the unknowns
/// are perturbed by one unit of rounding, with signs from a hash of the index. Restores images and halos for x_.
bool NewtonSolve::is_rounding_left(void* const* fields, const std::function<void()>& apply) {
  kept_ = left_;
  const std::size_t cells = unknowns_.cells();
  moved_.assign(x_.size() / cells, 0.0);
  for (int turn = 0; turn < moves; ++turn) {
    for (std::size_t i = 0; i < x_.size(); ++i)
      next_[i] = x_[i] * (1 + arbitrary_sign(moves * i + static_cast<std::size_t>(turn)) * rounding_);
    unknowns_.write(fields, next_);
    distance(fields, apply);
    for (std::size_t i = 0; i < x_.size(); ++i)
      moved_[i / cells] = std::max(moved_[i / cells], std::abs(left_[i] - kept_[i]));
  }
  unknowns_.write(fields, x_);
  distance(fields, apply);
  for (std::size_t i = 0; i < x_.size(); ++i) {
    if (!(std::abs(kept_[i]) <= roundings * moved_[i / cells])) return false;
  }
  return true;
}

double NewtonSolve::move(void* const* fields, const std::function<void()>& apply, double before, bool may_halve) {
  double part = 1, left = 0;
  for (int halving = 0; halving <= most_halvings; ++halving, part /= 2) {
    for (std::size_t i = 0; i < x_.size(); ++i) next_[i] = x_[i] + part * change_[i];
    unknowns_.write(fields, next_);
    left = distance(fields, apply);
    if (!may_halve || left <= 2 * before) break;
  }
  unknowns_.read(fields, x_);
  return left;
}

void NewtonSolve::fail(const std::string& why, double residual) const {
  throw Unsolved({.what = UnsolvedFacts::What::newton,
                  .text = fmt::format("newton for {}: {}", names_, why),
                  .reason = why,
                  .method = "newton",
                  .residual = residual,
                  .advice = [] {
                    return std::string(
                        "take a shorter time step, or first values closer to the "
                        "solution");
                  }});
}

/// If the right sides are 0 the residual itself is reported.
void NewtonSolve::fail(int steps, double left) const {
  const double size = length(right_);
  if (!std::isfinite(left)) fail(fmt::format("after {} steps the residual is not finite", steps), left);
  fail(fmt::format("after {} steps the residual is {:.3g}, with right sides of the size {:.3g}", steps, left, size),
       size > 0 ? left / size : left);
}

/// Solves the linear system of step k.
void NewtonSolve::solve_step(void* const* fields, const double* params, const std::function<void()>& apply_step,
                             int k) {
  step_rights_.write(fields, left_);
  try {
    step_.run(fields, params, apply_step);
  } catch (const Unsolved& error) {
    fail(fmt::format("the linear system of step {} has no solution: {}", k + 1, error.facts().text),
         error.facts().residual);
  }
  step_unknowns_.read(fields, change_);
}

}  // namespace dpde
