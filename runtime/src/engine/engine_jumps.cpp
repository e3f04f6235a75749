// SPDX-License-Identifier: Apache-2.0
// Detects jumps that make a gradient invalid. Formulas such as atan(1/p) jump at p = 0, and if(u > 5, 1, 0.2) at u = 5.
// They are differentiable in runs where p keeps its sign and u stays on one side. Before a gradient an extra run checks
// this: cell by cell, at each state on which a loss can depend, and at all intermediate values of its steps. Values in
// stages, subcycles and events are not states of a rollout: the step of that run records in extra states whether a
// value was below 0 and whether it was above.
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <span>
#include <utility>

#include "dpde/runtime/communicator.h"
#include "dpde/runtime/engine.h"
#include "dpde/runtime/unsolved.h"

namespace dpde {

namespace {

constexpr const char* change_of(const dpde_watched& watched) {
  return watched.is_switch != 0 ? "switches" : "changes its sign";
}

/// One value of dpde_scene::watched_values over a run.
class Watch {
 public:
  /// `steps`: where it is checked; empty: at each state. `starts_by_unknowns`: the initial state depends on unknowns,
  /// and so does the position of its zeros.
  Watch(const dpde_watched& watched, std::vector<int> steps, bool starts_by_unknowns, Communicator* ranks)
      : watched_(watched), steps_(std::move(steps)), starts_by_unknowns_(starts_by_unknowns), ranks_(ranks) {}

  bool looks_at(const Snapshot& now) const {
    return steps_.empty() || (!now.is_within_step && (now.step == 0 || is_due(now.step)));
  }
  /// Description of a jump between the previous states and this one; "": none.
  std::string jump_at(int step, const std::vector<double>& values) {
    if (step == 0) first_ = steps_.empty() ? Signs() : signs_of(values);
    if (!is_due(step)) return "";
    // A loss at this state and not at the one before does not depend on the states between two of its own.
    const bool is_alone = !steps_.empty() && before_ != step - 1;
    before_ = step;
    if (is_alone) signs_.clear();
    const bool is_first = signs_.empty();
    if (changes(values)) return change_of(watched_);
    if ((watched_.is_switch == 0 && !is_first) || !is_mixed(values)) return "";
    if (watched_.is_switch != 0) return "switches from cell to cell";
    const bool begins_so = watched_.begins_with_one_sign != 0 && starts_by_unknowns_;
    if (step == 0) return begins_so ? "has both signs where the run begins" : "";
    return is_alone && (begins_so || changes_in_part(values)) ? "has both signs" : "";
  }
  /// The same for a steady state, which does not depend on earlier ones.
  std::string jump_at_rest(const std::vector<double>& values) const {
    if (!is_mixed(values)) return "";
    return watched_.is_switch != 0 ? "switches from cell to cell" : "has both signs in the steady state";
  }

 private:
  bool is_due(int step) const { return steps_.empty() || std::ranges::binary_search(steps_, step); }
  using Signs = std::vector<signed char>;
  static Signs signs_of(const std::vector<double>& values) {
    Signs signs(values.size());
    std::ranges::transform(values, signs.begin(),
                           [](double value) { return static_cast<signed char>((value > 0) - (value < 0)); });
    return signs;
  }
  bool is_mixed(const std::vector<double>& values) const {
    const auto [least, most] = std::ranges::minmax(values);
    return largest_of(ranks_, most) > 0 && largest_of(ranks_, -least) > 0;
  }
  /// A value of 0 has the sign of the previous one.
  bool changes(const std::vector<double>& values) {
    signs_.resize(values.size(), 0);
    int is_changed = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const int sign = (values[i] > 0) - (values[i] < 0);
      is_changed |= static_cast<int>(sign * signs_[i] < 0);
      signs_[i] = static_cast<signed char>(sign != 0 ? sign : signs_[i]);
    }
    return largest_of(ranks_, is_changed) > 0;
  }
  /// Whether the sign has changed since the start in some cells and not in others: zeros have moved.
  bool changes_in_part(const std::vector<double>& values) const {
    int kept = 0, turned = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const int sign = (values[i] > 0) - (values[i] < 0);
      kept |= static_cast<int>(sign * first_[i] > 0);
      turned |= static_cast<int>(sign * first_[i] < 0);
    }
    return largest_of(ranks_, kept) > 0 && largest_of(ranks_, turned) > 0;
  }

  const dpde_watched& watched_;
  std::vector<int> steps_;
  bool starts_by_unknowns_;
  Communicator* ranks_;
  int before_ = -1;  // the last state that was checked
  Signs signs_, first_;
};

/// Records in which cells the stages of the steps so far had a value below 0, and in which above.
class Marks {
 public:
  /// Refers to the marks of `watched`.
  Marks(const dpde_watched& watched, const Rollout& rollout, const std::vector<void*>& states,
        const Workspace& workspace, Communicator* ranks)
      : ranks_(ranks) {
    const auto read = [&](const char* mark) {
      std::vector<double> values(workspace.cell_count());
      copy_out(workspace.layout(), states[static_cast<std::size_t>(rollout.state_index(mark))], values);
      return values;
    };
    below_ = read(watched.below);
    above_ = read(watched.above);
  }

  /// Some cell was on both sides.
  bool have_changed() const {
    return in_any_cell([](double below, double above) { return below > 0 && above > 0; });
  }
  /// Some cells were below and some above.
  bool have_both() const {
    return in_any_cell([](double below, double) { return below > 0; }) &&
           in_any_cell([](double, double above) { return above > 0; });
  }
  /// Within a single step some cells were only on one side: not all cells have crossed in the same way.
  bool are_mixed() const {
    return have_both() && in_any_cell([](double below, double above) { return (below > 0) != (above > 0); });
  }

 private:
  template <class Is>
  bool in_any_cell(const Is& is) const {
    int any = 0;
    for (std::size_t i = 0; i < below_.size(); ++i) any |= static_cast<int>(is(below_[i], above_[i]));
    return largest_of(ranks_, any) > 0;
  }

  Communicator* ranks_;
  std::vector<double> below_, above_;
};

Unsolved jump_of(const dpde_watched& watched, const std::string& what) {
  Unsolved error({.what = UnsolvedFacts::What::jump,
                  .text = fmt::format("{} {}", watched.text, what),
                  .advice = [help = std::string(watched.help)] { return help; }});
  error.set_solve_for(watched.field);
  return error;
}

}  // namespace

/// The last state with a loss.
int Engine::last_loss() const {
  int last = 0;
  for (int32_t i = 0; i < scene_.loss_count; ++i) {
    const std::vector<int> at = steps_of(scene_.losses[i].at);
    if (!at.empty()) last = std::max(last, at.back());
  }
  return last;
}

/// True unless `program` reads a given field whose formula depends on unknowns.
bool Engine::starts_by_unknowns(const dpde_program& program) const {
  const std::span<const char* const> inputs(program.fields, static_cast<std::size_t>(program.input_count));
  return std::ranges::none_of(inputs, [&](const char* name) {
    if (const int s = state_index(name); s >= 0) {
      const State& state = states_[static_cast<std::size_t>(s)];
      return state.is_given && !state.is_unknown && state.start == DPDE_START_SCENE;
    }
    const auto found = given_.find(std::string_view(name));
    if (found == given_.end()) return false;
    return found->second.is_given && !found->second.is_unknown && !found->second.is_needed;
  });
}

/// Evaluates the watched values at those states, with the data of the losses at state `step`.
void Engine::keep_watched(int step, double t, const Rollout& rollout, const std::vector<void*>& states) {
  Workspace::Bound bound;
  for (std::size_t s = 0; s < states.size(); ++s) bound[rollout.state_name(static_cast<int>(s))] = states[s];
  for (const Datum& datum : data_) {
    const auto found = std::ranges::find(datum.at, step);
    if (found == datum.at.end()) continue;
    bound[datum.name] = workspace_->field(datum.name, static_cast<std::size_t>(found - datum.at.begin())).base();
  }
  workspace_->execute(*scene_.watched, t, bound);
}

/// For runs until steady: one step from the steady state.
RolloutSetup Engine::watched_setup() {
  RolloutSetup watched = setup();
  watched.step = scene_.watched_step;
  if (watched.trial != nullptr) watched.trial = scene_.watched_step;
  if (watched.steady > 0) watched.steps = 1;
  watched.steady = 0;
  watched.block_steps = 1;
  return watched;
}

/// The rollout of the watched step, if there is one.
Rollout& Engine::watched_run() {
  Rollout& first = objective();
  begin(first);
  if (scene_.watched_step == nullptr) return first;
  if (!watched_) open(watched_, watched_setup());
  begin(*watched_);
  for (int32_t i = 0; i < scene_.watched_count; ++i) {
    for (const char* mark : {scene_.watched_values[i].below, scene_.watched_values[i].above}) {
      if (mark != nullptr) watched_->initial(watched_->state_index(mark)).fill(0);
    }
  }
  return *watched_;
}

/// Checks a steady state, which does not depend on earlier ones: the state itself, and the stages of the step of which
/// it is a fixed point.
std::optional<Unsolved> Engine::jump_at_rest() {
  const std::span<const dpde_watched> watched(scene_.watched_values, static_cast<std::size_t>(scene_.watched_count));
  Rollout& rollout = objective();
  begin(rollout);
  const RunResult done = rollout.run();
  if (!done.steady || !done.steady->is_reached) return std::nullopt;  // the gradient itself will report this
  const auto error = [&](const dpde_watched& one, const std::string& what) {
    Unsolved jump = jump_of(one, what);
    jump.set_place(done.steady->step, scene_.steps, done.steady->t);
    return jump;
  };
  std::vector<double> values(workspace_->cell_count());
  keep_watched(scene_.steps, done.steady->t, rollout, rollout.final_states());
  for (const dpde_watched& one : watched) {
    workspace_->field(one.field).copy_out(values);
    const std::string what = Watch(one, {}, false, options_.ranks).jump_at_rest(values);
    if (!what.empty()) return error(one, what);
  }
  Rollout& step = watched_run();
  if (&step == &rollout) return std::nullopt;
  for (std::size_t s = 0; s < states_.size(); ++s)
    copy_all(workspace_->layout(), step.initial(step.state_index(states_[s].name)).base(), rollout.final_states()[s]);
  step.set_begin(done.steady->t);
  step.run();
  for (const dpde_watched& one : watched) {
    if (one.below != nullptr && Marks(one, step, step.final_states(), *workspace_, options_.ranks).are_mixed())
      return error(one, one.is_switch != 0 ? "switches from cell to cell" : "has both signs in the steady state");
  }
  return std::nullopt;
}

std::optional<Unsolved> Engine::jump_in_run() {
  if (scene_.watched == nullptr) return std::nullopt;
  if (scene_.steady > 0) return jump_at_rest();
  const std::span<const dpde_watched> watched(scene_.watched_values, static_cast<std::size_t>(scene_.watched_count));
  const bool starts_so = starts_by_unknowns(*scene_.watched);
  std::vector<Watch> watches;
  for (const dpde_watched& one : watched)
    watches.emplace_back(one, one.loss > 0 ? steps_of(scene_.losses[one.loss - 1].at) : std::vector<int>(), starts_so,
                         options_.ranks);
  Rollout& rollout = watched_run();
  std::optional<Unsolved> jump;
  std::vector<double> values(workspace_->cell_count());
  const auto look_at = [&](std::size_t i, const Snapshot& now) -> std::string {
    if (!watches[i].looks_at(now)) return "";
    workspace_->field(watched[i].field).copy_out(values);
    const std::string what = watches[i].jump_at(now.step, values);
    if (!what.empty() || watched[i].below == nullptr) return what;
    const Marks marks(watched[i], rollout, now.states, *workspace_, options_.ranks);
    if (marks.have_changed()) return change_of(watched[i]);
    return watched[i].is_switch != 0 && marks.have_both() ? "switches from cell to cell" : "";
  };
  const int last = last_loss();
  const auto look_if_due = [&](const Snapshot& now) {
    if (jump || now.step > last) return;
    if (std::ranges::none_of(watches, [&](const Watch& watch) { return watch.looks_at(now); })) return;
    keep_watched(now.step, now.t, rollout, now.states);
    for (std::size_t i = 0; i < watched.size() && !jump; ++i) {
      const std::string what = look_at(i, now);
      if (!what.empty()) jump = jump_of(watched[i], what);
    }
    if (jump) jump->set_place(now.step, scene_.steps, now.t);
  };
  rollout.run({1, look_if_due, true});
  return jump;
}

}  // namespace dpde
