// SPDX-License-Identifier: Apache-2.0
#include "loop/schedule.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace dpde::loop {

namespace {

using Items = std::vector<ScheduleItem>;

const Fill* as_fill(const ScheduleItem& item) { return std::get_if<Fill>(&item.operation); }

const Fill* fill_of(const Items& items, const std::string& field) {
  for (const ScheduleItem& item : items) {
    const Fill* fill = as_fill(item);
    if (fill && fill->field == field) return fill;
  }
  return nullptr;
}

/// Whether the fill computes values on walls from values inside. These are part of the result, so that only the program
/// itself may decide whether the fill runs.
bool derives_walls(const Fill& fill) {
  const auto derives = [](const Side& side) { return side.rule && side.rule->on_walls && !side.is_value(); };
  return std::any_of(fill.axes.begin(), fill.axes.end(),
                     [&](const AxisBoundary& axis) { return derives(axis.low) || derives(axis.high); });
}

/// Whether all fills of the field are the same.
bool agrees(const Items& items, const std::string& field, const std::vector<AxisBoundary>& axes) {
  return std::all_of(items.begin(), items.end(), [&](const ScheduleItem& item) {
    const Fill* fill = as_fill(item);
    return !fill || fill->field != field || fill->axes == axes;
  });
}

/// The last item before `end` that modifies the field.
std::optional<std::size_t> last_modifier(const Items& items, const std::string& field, std::size_t end) {
  for (std::size_t i = end; i-- > 0;) {
    if (items[i].modified.contains(field)) return i;
  }
  return std::nullopt;
}

class Scheduler {
 public:
  explicit Scheduler(ScheduleInput input) : input_(std::move(input)) {}
  Schedule run();

 private:
  const Items& items() const { return input_.items; }
  bool is_prepared(const std::string& field, std::set<std::string> assumed) const;
  bool next_can_be_filled(const Swap& swap, const Fill& fill, const std::set<std::string>& assumed) const;
  bool can_take_fills(const ScheduleItem& item) const;
  void prepare_inputs();
  void fill_next(const Swap& swap, const Fill& fill);
  void attach_to_sweeps();
  bool attach(std::size_t at);

  ScheduleInput input_;
  std::set<std::string> next_states_;  // fields with a fill for the next step
  Schedule result_;
};

/// Whether the fills of this input may move out of the body. `assumed`: visited states (swaps can form a cycle).
bool Scheduler::is_prepared(const std::string& field, std::set<std::string> assumed) const {
  if (!assumed.insert(field).second) return true;
  const Fill* fill = fill_of(items(), field);
  const auto& inputs = input_.inputs;
  if (!fill || std::find(inputs.begin(), inputs.end(), field) == inputs.end()) return false;
  if (!agrees(items(), field, fill->axes) || input_.filled_each_run.contains(field)) return false;
  if (last_modifier(items(), field, items().size())) return false;
  return std::all_of(input_.swaps.begin(), input_.swaps.end(),
                     [&](const Swap& swap) { return swap.state != field || next_can_be_filled(swap, *fill, assumed); });
}

bool Scheduler::next_can_be_filled(const Swap& swap, const Fill& fill, const std::set<std::string>& assumed) const {
  if (!agrees(items(), swap.next, fill.axes)) return false;
  if (derives_walls(fill) && !fill_of(items(), swap.next)) return false;
  if (last_modifier(items(), swap.next, items().size())) return true;
  return is_prepared(swap.next, assumed);  // as u_prev, u: `next` is an input whose halo is filled already
}

void Scheduler::prepare_inputs() {
  for (const std::string& field : input_.inputs) {
    if (is_prepared(field, {})) result_.prepare.push_back(*fill_of(items(), field));
  }
  for (const Fill& fill : result_.prepare) {
    std::erase_if(input_.items, [&](const ScheduleItem& item) {
      const Fill* other = as_fill(item);
      return other && other->field == fill.field;
    });
  }
  for (const Fill& fill : result_.prepare) {
    for (const Swap& swap : input_.swaps) {
      if (swap.state == fill.field) fill_next(swap, fill);
    }
  }
}

/// Makes the body fill the halo of `next`.
void Scheduler::fill_next(const Swap& swap, const Fill& fill) {
  const std::optional<std::size_t> writer = last_modifier(items(), swap.next, items().size());
  if (!writer) return;
  for (std::size_t i = *writer + 1; i < items().size(); ++i) {
    const Fill* other = as_fill(items()[i]);
    if (other && other->field == swap.next) return;
  }
  const bool is_grown = std::any_of(items().begin(), items().end(), [&](const ScheduleItem& item) {
    const Sweep* sweep = std::get_if<Sweep>(&item.operation);
    return sweep && sweep->grow > 0 && item.modified.contains(swap.next);
  });
  // A halo that no sweep computes is not read before the swap: the fill may run at any time after the writer.
  if (!is_grown) next_states_.insert(swap.next);
  input_.items.push_back({Fill{swap.next, fill.axes}, {}, {swap.next}});
}

/// Whether fills can run within the sweep. A sweep with `grow` writes halo cells itself, and a serial sweep does not
/// finish row by row: fills must follow both.
bool Scheduler::can_take_fills(const ScheduleItem& item) const {
  const Sweep* sweep = std::get_if<Sweep>(&item.operation);
  if (!sweep || sweep->serial) return false;
  const bool has_ends = std::find(input_.axes.begin(), input_.axes.end(), Topology::bounded) != input_.axes.end();
  return sweep->grow == 0 || !has_ends;
}

/// Whether a side takes its values from a field, or from rows half a turn away: such a fill runs after the whole sweep,
/// when all these values are computed.
bool is_of_all(const Fill& fill) {
  const auto is_side = [](const Side& side) { return !side.field.empty() || (side.rule && side.rule->turns); };
  return std::any_of(fill.axes.begin(), fill.axes.end(),
                     [&](const AxisBoundary& axis) { return is_side(axis.low) || is_side(axis.high); });
}

/// Whether the halo of this result of a repeat has this fill already, because the last pass filled its carried field.
bool is_left_filled(const Repeat& repeat, const Fill& fill) {
  const auto carry = std::find_if(repeat.carries.begin(), repeat.carries.end(),
                                  [&](const LoopCarried& each) { return each.result == fill.field; });
  if (carry == repeat.carries.end()) return false;
  const Fill in_pass{carry->next, fill.axes};
  return std::any_of(repeat.body.begin(), repeat.body.end(), [&](const Operation& operation) {
    const Sweep* sweep = std::get_if<Sweep>(&operation);
    const Repeat* inner = std::get_if<Repeat>(&operation);
    if (inner != nullptr) return is_left_filled(*inner, in_pass);
    return sweep != nullptr && std::find(sweep->then.begin(), sweep->then.end(), in_pass) != sweep->then.end();
  });
}

/// Moves the fill at `at` into the sweep that wrote its field, or drops it if the halo is filled already.
bool Scheduler::attach(std::size_t at) {
  const Fill fill = *as_fill(items()[at]);
  const std::optional<std::size_t> writer = last_modifier(items(), fill.field, at);
  if (!writer || is_of_all(fill) || !agrees(items(), fill.field, fill.axes)) return false;
  if (Sweep* sweep = std::get_if<Sweep>(&input_.items[*writer].operation)) {
    if (std::find(sweep->then.begin(), sweep->then.end(), fill) != sweep->then.end()) return true;
    const bool touched = std::any_of(items().begin() + static_cast<std::ptrdiff_t>(*writer) + 1,
                                     items().begin() + static_cast<std::ptrdiff_t>(at),
                                     [&](const ScheduleItem& item) { return item.touched.contains(fill.field); });
    if (can_take_fills(items()[*writer]) && (!touched || next_states_.contains(fill.field))) {
      sweep->then.push_back(fill);
      return true;
    }
  }
  const Repeat* repeat = std::get_if<Repeat>(&items()[*writer].operation);
  return repeat != nullptr && is_left_filled(*repeat, fill);
}

void Scheduler::attach_to_sweeps() {
  for (std::size_t i = 0; i < input_.items.size();) {
    if (as_fill(items()[i]) && attach(i)) {
      input_.items.erase(input_.items.begin() + static_cast<std::ptrdiff_t>(i));
    } else {
      ++i;
    }
  }
}

Schedule Scheduler::run() {
  prepare_inputs();
  attach_to_sweeps();
  for (ScheduleItem& item : input_.items) result_.body.push_back(std::move(item.operation));
  return std::move(result_);
}

}  // namespace

Schedule schedule(ScheduleInput input) { return Scheduler(std::move(input)).run(); }

}  // namespace dpde::loop
