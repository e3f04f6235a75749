// SPDX-License-Identifier: Apache-2.0
#include "run/forward/stepper.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "dpde/runtime/communicator.h"
#include "dpde/runtime/float_mode.h"
#include "dpde/runtime/layout.h"
#include "run/forward/blocks.h"

namespace dpde {
namespace {

constexpr int most_parts = 100000;       // of a step: if more are needed the run has blown up
constexpr double smallest_part = 1e-12;  // of a step

}  // namespace

Stepper::Stepper(const RolloutSetup& setup, const StepInputs& inputs, const States& states, Binder& binder)
    : setup_(setup),
      inputs_(inputs),
      states_(states),
      step_(binder.bind_step(setup.trial != nullptr ? *setup.trial : *setup.step)),
      part_states_(setup.layout, states.count()),
      control_(setup.first_part, setup.error_order) {
  if (setup.rate != nullptr) rate_.emplace(binder.bind_rate());
}

/// Plans temporal blocking if a plain sweep exceeds the core's own cache: as many steps as limit the repeated work.
void Stepper::plan_block() {
  const Executor& executor = step_.program.executor;
  if (setup_.block_steps == 1 || has_parts(setup_)) return;
  if (setup_.block_steps > 1) {
    block_ = Wavefront::make(executor, setup_.block_steps, setup_.team);
    return;
  }
  if (!may_pay_in_blocks(*setup_.step, setup_.layout)) return;
  int longest = setup_.steps;
  for (const ControlField& control : setup_.control_fields) longest = std::min(longest, control.every);
  for (const int steps : {16, 8, 4, 2}) {
    if (steps > longest) continue;
    block_ = Wavefront::make(executor, steps, setup_.team);
    if (block_ && block_->work() <= most_extra_work) return;
  }
  block_.reset();
}

void Stepper::prepare(int n, const StateBuffer& state) {
  inputs_.set(step_.program, n);
  step_.program.bind_states(state);
  step_.program.prepare_states();
  step_.program.prepare_inputs();
}

int Stepper::steps_at_once(int n, int until) const {
  return block_ && std::min(until, inputs_.end_of_intervals(n)) - n >= block_->steps() ? block_->steps() : 1;
}

void Stepper::steps(int n, int count, const StateBuffer& from, const StateBuffer& to) {
  if (count == 1) return step(n, from, to);
  run_block(*block_, n, from, to);
}

void Stepper::run_block(Wavefront& block, int n, const StateBuffer& from, std::span<void* const> results,
                        BoundProgram* adjoint) {
  const Stopwatch watch(setup_.seconds == nullptr ? nullptr
                        : adjoint != nullptr      ? &setup_.seconds->adjoints.all
                                                  : &setup_.seconds->steps.all);
  for (size_t p = 0; p < block.passes().size(); ++p) {
    const WavefrontPass& pass = block.passes()[p];
    BoundProgram& program = pass.program == 0 || adjoint == nullptr ? step_.program : *adjoint;
    inputs_.set(program, n + pass.step);
    block.set_uniforms(p, program.executor.uniforms());
  }
  step_.program.bind_states(from);
  block.run(results);
}

void Stepper::step(int n, const StateBuffer& from, const StateBuffer& to) {
  if (setup_.trial != nullptr && !control_.parts().has(n)) return step_under_tolerance(n, from, to);
  const int parts = parts_of(n, from);
  const StateBuffer* now = &from;
  for (int part = 0; part < parts; ++part) {
    const StateBuffer& next = part + 1 == parts ? to : part_states_[part % 2];
    part_of_step(n, part_at(n, part, parts), *now, next);
    if (part + 1 < parts) show_part(n, part_at(n, part, parts), next);
    now = &next;
  }
}

PartOfStep Stepper::part_at(int n, int part, int parts) const {
  if (parts > 1 && !rate_) return control_.parts().of(n)[static_cast<size_t>(part)];
  return {part * (setup_.dt / parts), setup_.dt / parts};
}

void Stepper::part_of_step(int n, const PartOfStep& part, const StateBuffer& from, const StateBuffer& to) {
  step_.bind(from, to);
  inputs_.set(step_.program, n, part);
  inputs_.run_in_step(step_.program.executor, n, part.begin);
  ++made_;
}

void Stepper::show_parts(const Observer* observer, FloatMode of_host) {
  observer_ = observer;
  host_mode_ = of_host;
}

/// Shows the state at the end of a substep to the observer.
void Stepper::show_part(int n, const PartOfStep& part, const StateBuffer& state) const {
  if (observer_ == nullptr) return;
  const FloatScope of_host(host_mode_);
  observer_->call({n + 1, inputs_.time(n) + part.begin + part.length, state, false, true});
}

/// Number of substeps. 1 for a state that has blown up: the check for values that are not finite will find it.
int Stepper::parts_of(int n, const StateBuffer& state) {
  if (!rate_) return has_parts(setup_) ? static_cast<int>(control_.parts().of(n).size()) : 1;
  BoundProgram& program = rate_->program;
  inputs_.set(program, n);
  program.bind_states(state);
  program.prepare_inputs();
  inputs_.run_in_step(program.executor, n);
  const double fastest = largest_of(setup_.ranks, largest(setup_.layout, program.executor.bound(rate_->field)));
  const double parts = std::ceil(setup_.dt * fastest / setup_.courant - 1e-9);
  if (parts <= most_parts) return std::max(1, static_cast<int>(parts));
  if (!is_finite_state(n, state)) return 1;
  const std::string why = std::isfinite(parts) ? fmt::format("it would take {} parts, more than {}", parts, most_parts)
                                               : "the speed is not a finite number";
  fail_in_parts(n, inputs_.time(n), "it cannot be limited by a Courant number: " + why,
                "look at what speed is there (dpde run --every 1 keeps the states), or take a shorter step");
}

/// Makes a substep; returns its error over the tolerated one. Infinite if it is NaN, or if a solve fails: `unsolved`.
double Stepper::estimate_part(int n, const PartOfStep& part, const StateBuffer& from, const StateBuffer& to,
                              std::optional<Unsolved>& unsolved) {
  unsolved.reset();
  try {
    part_of_step(n, part, from, to);
  } catch (const Unsolved& error) {
    unsolved = error;
    return std::numeric_limits<double>::infinity();
  }
  const auto cells = static_cast<double>(global_cell_count(setup_.layout));
  const double error = std::sqrt(step_.program.executor.sums()[0] / cells);
  return std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
}

/// Throws if substeps become too short or too many; if a solve failed in them, that is the cause.
void Stepper::check_parts(int n, const PartOfStep& next, size_t made, const std::optional<Unsolved>& unsolved) const {
  const bool is_too_short = next.length < smallest_part * setup_.dt;
  if (!is_too_short && made <= most_parts) return;
  if (is_too_short && unsolved) throw Unsolved(*unsolved);
  const std::string why =
      is_too_short ? fmt::format("the estimated error is still too large for a substep of {:.3g}", next.length)
                   : fmt::format("it would take more than {} parts", most_parts);
  fail_in_parts(n, inputs_.time(n) + next.begin, "it cannot meet its tolerance: " + why,
                "the solution may end there, as one that grows without bounds does: end the run before, or take a "
                "larger tolerance");
}

void Stepper::fail_in_parts(int n, double t, const std::string& why, const char* advice) const {
  Unsolved error(
      {.what = UnsolvedFacts::What::substeps, .text = why, .advice = [advice] { return std::string(advice); }});
  error.set_place(n + 1, setup_.steps, t);
  throw error;
}

void Stepper::step_under_tolerance(int n, const StateBuffer& from, const StateBuffer& to) {
  const StateBuffer* now = &from;
  const size_t before = control_.recorded();
  PartOfStep part;
  std::optional<Unsolved> unsolved;
  while (part.begin < setup_.dt) {
    const double rest = setup_.dt - part.begin;
    part.length = control_.length(rest);
    const bool is_last = part.length == rest;
    if (part.length < smallest_part * setup_.dt && !is_finite_state(n, *now)) {
      part.length = rest;  // the length does not matter: the check for values that are not finite will find it
      part_of_step(n, part, *now, to);
      control_.record(part);
      break;
    }
    check_parts(n, part, control_.recorded() - before, unsolved);
    const StateBuffer& next = is_last ? to : part_states_[now == &part_states_[0] ? 1 : 0];
    const double error = estimate_part(n, part, *now, next, unsolved);
    if (!(error <= 1)) {
      ++refused_;
      --made_;
      control_.refuse(part, error);
      continue;
    }
    control_.accept(part, error);
    if (is_last) break;
    show_part(n, part, next);
    now = &next;
    part.begin += part.length;
  }
  control_.end_step();
}

}  // namespace dpde
