// SPDX-License-Identifier: Apache-2.0
// Steps that are done in parts: as many equal ones as a Courant number says, or of lengths that keep an estimated error
// below a tolerance. Those lengths are recorded, and whoever makes the step again or goes back through it reads them.
//
// The controller is nearly that of DOPRI5, which lets parts grow tenfold and shortens refused ones otherwise (Hairer,
// Norsett, Wanner, Solving Ordinary Differential Equations I, II.4, and II, IV.2; Gustafsson 1991): with e the error
// over what is tolerated, of the order k in the length h,
//   h_next = h*0.9*e^-(0.85/k)*e_before^(0.2/k), within h/5 and 5*h.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "dpde/runtime/error.h"
#include "dpde/runtime/layout.h"
#include "dpde/runtime/unsolved.h"
#include "rollout_impl.h"

namespace dpde {
namespace {

constexpr int most_parts = 100000;       // of a step: what needs more has blown up
constexpr double smallest_part = 1e-12;  // of a step
constexpr double safety = 0.9, most_change = 5, least_error_before = 1e-4;

/// Parts that are shortened to end with the step leave none behind them that is shorter than themselves.
double length_within(double wanted, double rest) {
  return wanted >= rest * (1 - 1e-9) ? rest : std::min(wanted, rest / 2);
}

void accept(StepController& controller, double length, double error, int order) {
  const double now = std::max(error, 1e-10);
  const double factor = safety * std::pow(now, -0.85 / order) * std::pow(controller.error, 0.2 / order);
  const double most = controller.has_refused ? 1 : most_change;
  const double next = length * std::clamp(factor, 1 / most_change, most);
  // A length that the end of the step has cut says nothing against the one that was wanted.
  controller.length = length < controller.length ? std::max(next, controller.length) : next;
  controller.error = std::max(error, least_error_before);
  controller.has_refused = false;
}

void refuse(StepController& controller, double length, double error, int order) {
  const double factor = std::isfinite(error) ? safety * std::pow(error, -1.0 / order) : 0;
  controller.length = length * std::max(factor, 1 / most_change);
  controller.has_refused = true;
}

}  // namespace

void Rollout::Impl::begin_record(int first) {
  record.begin(first);
  if (first == 0 || controller.length == 0) controller = {setup.first_part, 1, false};
}

void Rollout::Impl::part_of_step(int n, const PartOfStep& part, const StateBuffer& from, const StateBuffer& to) {
  bind_buffers(*forward, from, to);
  set_part(forward->program, n, part);
  run_in_step(forward->program.executor, n, part.begin);
  ++parts_made;
}

/// The state at its end, to who observes it.
void Rollout::Impl::show_part(int n, const PartOfStep& part, const StateBuffer& state) const {
  if (observer_of_parts == nullptr) return;
  const FloatScope of_host(host_mode);
  observer_of_parts->call({n + 1, time(n) + part.begin + part.length, state, false, true});
}

void Rollout::Impl::step(int n, const StateBuffer& from, const StateBuffer& to) {
  if (setup.trial != nullptr && !steps_made().has(n)) return step_under_tolerance(n, from, to);
  const int parts = parts_of(n, from);
  const StateBuffer* now = &from;
  for (int part = 0; part < parts; ++part) {
    const StateBuffer& next = part + 1 == parts ? to : part_buffer(part % 2);
    part_of_step(n, part_at(n, part, parts), *now, next);
    if (part + 1 < parts) show_part(n, part_at(n, part, parts), next);
    now = &next;
  }
}

/// Into how many parts step n is split. What has blown up is not worth more than one: the look
/// for values that are not finite finds it.
int Rollout::Impl::parts_of(int n, const StateBuffer& state) {
  if (!rate) return has_parts() ? static_cast<int>(steps_made().of(n).size()) : 1;
  set_step(rate->program, n);
  rate->program.bind_states(state);
  rate->program.prepare_inputs();
  run_in_step(rate->program.executor, n);
  const double fastest = largest_of(setup.ranks, largest(setup.layout, rate->program.executor.bound(rate->field)));
  const double parts = std::ceil(setup.dt * fastest / setup.courant - 1e-9);
  if (parts <= most_parts) return std::max(1, static_cast<int>(parts));
  if (find_blow_up(n, state)) return 1;
  const std::string why = std::isfinite(parts) ? fmt::format("it would take {} parts, more than {}", parts, most_parts)
                                               : "the speed is not a finite number";
  fail_in_parts(n, time(n), "it cannot be limited by a Courant number: " + why,
                "look at what speed is there (dpde run --every 1 keeps the states), or take a shorter step");
}

/// States between the parts of a step, made when they are first needed.
const StateBuffer& Rollout::Impl::part_buffer(int part) {
  while (part_buffers.size() <= static_cast<size_t>(part)) {
    part_pools.emplace_back(setup.layout, static_cast<int64_t>(state_names.size()));
    StateBuffer& buffer = part_buffers.emplace_back();
    for (size_t s = 0; s < state_names.size(); ++s) buffer.push_back(part_pools.back().base(static_cast<int64_t>(s)));
  }
  return part_buffers[static_cast<size_t>(part)];
}

/// Its error over what is tolerated; infinite where it is no number, or a solve in it finds nothing: `unsolved`.
double Rollout::Impl::estimate_part(int n, const PartOfStep& part, const StateBuffer& from, const StateBuffer& to,
                                    std::optional<Unsolved>& unsolved) {
  unsolved.reset();
  try {
    part_of_step(n, part, from, to);
  } catch (const Unsolved& error) {
    unsolved = error;
    return std::numeric_limits<double>::infinity();
  }
  const auto cells = static_cast<double>(global_cell_count(setup.layout));
  const double error = std::sqrt(forward->program.executor.sums()[0] / cells);
  return std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
}

/// Where a solve has found nothing in a part as short as that it is what is wrong.
void Rollout::Impl::check_parts(int n, const PartOfStep& next, size_t made,
                                const std::optional<Unsolved>& unsolved) const {
  const bool is_too_short = next.length < smallest_part * setup.dt;
  if (!is_too_short && made <= most_parts) return;
  if (is_too_short && unsolved) throw Unsolved(*unsolved);
  const std::string why = is_too_short
                              ? fmt::format("the estimated error is still too large for a part of {:.3g}", next.length)
                              : fmt::format("it would take more than {} parts", most_parts);
  fail_in_parts(n, time(n) + next.begin, "it cannot keep its tolerance: " + why,
                "the solution may end there, as one that grows without bounds does: end the run before, or take a "
                "larger tolerance");
}

void Rollout::Impl::fail_in_parts(int n, double t, const std::string& why, const char* advice) const {
  Unsolved error(
      {.what = UnsolvedFacts::What::substeps, .text = why, .advice = [advice] { return std::string(advice); }});
  error.set_place(n + 1, setup.steps, t);
  throw error;
}

void Rollout::Impl::step_under_tolerance(int n, const StateBuffer& from, const StateBuffer& to) {
  const StateBuffer* now = &from;
  const size_t before = record.parts.size();
  PartOfStep part;
  std::optional<Unsolved> unsolved;
  while (part.begin < setup.dt) {
    const double rest = setup.dt - part.begin;
    part.length = length_within(controller.length, rest);
    const bool is_last = part.length == rest;
    if (part.length < smallest_part * setup.dt && find_blow_up(n, *now)) {
      part.length = rest;  // it does not matter how: who looks for values that are not finite finds them
      part_of_step(n, part, *now, to);
      record.parts.push_back(part);
      break;
    }
    check_parts(n, part, record.parts.size() - before, unsolved);
    const StateBuffer& next = is_last ? to : part_buffer(now == &part_buffer(0) ? 1 : 0);
    const double error = estimate_part(n, part, *now, next, unsolved);
    if (!(error <= 1)) {
      ++parts_refused;
      --parts_made;
      refuse(controller, part.length, error, setup.error_order);
      continue;
    }
    accept(controller, part.length, error, setup.error_order);
    record.parts.push_back(part);
    if (is_last) break;
    show_part(n, part, next);
    now = &next;
    part.begin += part.length;
  }
  record.ends.push_back(record.parts.size());
}

}  // namespace dpde
