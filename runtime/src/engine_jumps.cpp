// SPDX-License-Identifier: Apache-2.0
// Gradients that take for granted that nothing jumps. Formulas such as atan(1/p) jump where p is 0, and those with
// if(u > 5, 1, 0.2) where u is 5. They are differentiable in runs where p keeps its sign and u stays on one side.
// Before a gradient a run looks whether they do: at each state that a loss can hang on, cell by cell.
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <span>

#include "dpde/runtime/communicator.h"
#include "dpde/runtime/engine.h"
#include "dpde/runtime/unsolved.h"

namespace dpde {

namespace {

/// One value of dpde_scene::watched_values over a run.
class Watch {
 public:
  Watch(const dpde_watched& watched, Communicator* ranks) : watched_(watched), ranks_(ranks) {}

  /// What a jump says of itself; "" where there is none from the states before to this one. `is_by_formulas`: where a
  /// run begins follows parameters, and so does the place of a zero in it.
  std::string jump_at(const std::vector<double>& values, bool is_by_formulas) {
    const bool is_first = signs_.empty(), is_changed = changes(values);
    if (is_changed) return watched_.is_switch != 0 ? "switches" : "changes its sign";
    const bool is_one = watched_.is_switch != 0 || (is_first && watched_.begins_with_one_sign != 0 && is_by_formulas);
    if (!is_one || !is_mixed(values)) return "";
    return watched_.is_switch == 0 ? "has both signs where the run begins" : "switches from cell to cell";
  }

 private:
  bool is_mixed(const std::vector<double>& values) const {
    const auto [least, most] = std::ranges::minmax(values);
    return largest_of(ranks_, most) > 0 && largest_of(ranks_, -least) > 0;
  }
  /// A value of 0 has the sign of the one before.
  bool changes(const std::vector<double>& values) {
    signs_.resize(values.size(), 0);
    bool is_changed = false;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto sign = static_cast<signed char>((values[i] > 0) - (values[i] < 0));
      is_changed = is_changed || sign * signs_[i] < 0;
      if (sign != 0) signs_[i] = sign;
    }
    return largest_of(ranks_, is_changed ? 1 : 0) > 0;
  }

  const dpde_watched& watched_;
  Communicator* ranks_;
  std::vector<signed char> signs_;
};

Unsolved jump_of(const dpde_watched& watched, const std::string& what) {
  Unsolved error({.what = UnsolvedFacts::What::jump,
                  .text = fmt::format("{} {}", watched.text, what),
                  .advice = [help = std::string(watched.help)] { return help; }});
  error.set_solve_for(watched.field);
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

/// A steady state hangs on no state before it: the last one alone is looked at.
std::optional<Unsolved> Engine::jump_in_run() {
  if (scene_.watched == nullptr) return std::nullopt;
  const std::span<const dpde_watched> watched(scene_.watched_values, static_cast<std::size_t>(scene_.watched_count));
  const std::span<const char* const> inputs(scene_.watched->fields,
                                            static_cast<std::size_t>(scene_.watched->input_count));
  const bool is_by_formulas = std::ranges::all_of(inputs, [&](const char* name) {
    return (state_index(name) < 0 && !given_.contains(name)) || comes_from_formula(name);
  });
  std::vector<Watch> watches;
  for (const dpde_watched& one : watched) watches.emplace_back(one, options_.ranks);
  std::optional<Unsolved> jump;
  const int last = last_loss();
  const auto look = [&](const Snapshot& now) {
    if (jump || now.step > last || (scene_.steady > 0 && !now.is_last)) return;
    Workspace::Bound bound;
    for (std::size_t s = 0; s < states_.size(); ++s) bound[states_[s].name] = now.states[s];
    workspace_->execute(*scene_.watched, now.t, bound);
    for (std::size_t i = 0; i < watched.size() && !jump; ++i) {
      const std::string what =
          watches[i].jump_at(workspace_->dense(watched[i].field), is_by_formulas && scene_.steady == 0);
      if (!what.empty()) jump = jump_of(watched[i], what);
    }
    if (jump) jump->set_place(now.step, scene_.steps, now.t);
  };
  Rollout& rollout = objective();
  begin(rollout);
  rollout.run({1, look});
  return jump;
}

}  // namespace dpde
