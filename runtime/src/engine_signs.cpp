// SPDX-License-Identifier: Apache-2.0
// Gradients that hang on signs. Formulas such as atan(1/p) jump where p is 0, and are taken for differentiable as p
// is held to keep its sign. Before a gradient a run looks whether it does: each divisor of the scene's table, at each
// state that a loss can hang on, cell by cell.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <span>

#include "dpde/runtime/communicator.h"
#include "dpde/runtime/engine.h"
#include "dpde/runtime/unsolved.h"

namespace dpde {

namespace {

/// The signs that a divisor last had; 0 where it has only been 0.
class SignTrace {
 public:
  /// Whether it has both signs.
  static bool is_mixed(std::span<const double> values, Communicator* ranks) {
    const auto [least, most] = std::ranges::minmax(values);
    return largest_of(ranks, most) > 0 && largest_of(ranks, -least) > 0;
  }
  /// Goes on to the next state. Whether the sign changes in a cell.
  bool changes(std::span<const double> values, Communicator* ranks) {
    signs_.resize(values.size(), 0);
    bool is_changed = false;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto sign = static_cast<signed char>((values[i] > 0) - (values[i] < 0));
      is_changed = is_changed || sign * signs_[i] < 0;
      if (sign != 0) signs_[i] = sign;
    }
    return largest_of(ranks, is_changed ? 1 : 0) > 0;
  }

 private:
  std::vector<signed char> signs_;
};

Unsolved error_of(const dpde_divisor& divisor, const std::string& what) {
  Unsolved error({.what = UnsolvedFacts::What::sign,
                  .text = fmt::format("this divides by {}, which {}", divisor.text, what),
                  .advice = [] {
                    return std::string(
                        "write a smooth function of it, or begin where it keeps its sign; --force, in hosts force, "
                        "goes on without the jump");
                  }});
  error.set_solve_for(divisor.field);
  return error;
}

}  // namespace

/// The last state that a loss is of.
int Engine::last_loss() const {
  int last = 0;
  for (int32_t i = 0; i < scene_.loss_count; ++i) {
    const std::vector<int> at = steps_of(scene_.losses[i].at);
    if (!at.empty()) last = std::max(last, at.back());
  }
  return last;
}

/// A steady state hangs on no state before it.
std::optional<Unsolved> Engine::lost_sign() {
  if (scene_.divisors == nullptr || scene_.steady > 0) return std::nullopt;
  const std::span<const dpde_divisor> divisors(scene_.divisor, static_cast<std::size_t>(scene_.divisor_count));
  const std::span<const char* const> inputs(scene_.divisors->fields,
                                            static_cast<std::size_t>(scene_.divisors->input_count));
  const bool is_by_formulas = std::ranges::all_of(inputs, [&](const char* name) {
    return (state_index(name) < 0 && !given_.contains(name)) || comes_from_formula(name);
  });
  std::vector<SignTrace> traces(divisors.size());
  std::optional<Unsolved> lost;
  const int last = last_loss();
  const auto look = [&](const Snapshot& now) {
    if (lost || now.step > last) return;
    Workspace::Bound bound;
    for (std::size_t s = 0; s < states_.size(); ++s) bound[states_[s].name] = now.states[s];
    workspace_->execute(*scene_.divisors, now.t, bound);
    for (std::size_t d = 0; d < divisors.size() && !lost; ++d) {
      const std::vector<double> values = workspace_->dense(divisors[d].field);
      const bool begins_as_one = now.step == 0 && divisors[d].begins_with_one_sign != 0 && is_by_formulas;
      if (begins_as_one && SignTrace::is_mixed(values, options_.ranks)) {
        lost = error_of(divisors[d], "has both signs where the run begins");
      } else if (traces[d].changes(values, options_.ranks)) {
        lost = error_of(divisors[d], "changes its sign");
      }
    }
    if (lost) lost->set_place(now.step, scene_.steps, now.t);
  };
  Rollout& rollout = objective();
  begin(rollout);
  rollout.run({1, look});
  return lost;
}

}  // namespace dpde
