// SPDX-License-Identifier: Apache-2.0
#include "stencil/lower/events.h"

#include <algorithm>
#include <optional>

#include "stencil/build.h"

namespace dpde::stencil {

namespace {

Expr time_at_end() { return param("t") + param("dt"); }

/// Number of steps at the end of this one; the rounding error of t is much less than half a step. Between substeps the
/// number is half a step away from that of any event.
Expr steps_done(const model::Problem& problem) {
  if (!problem.has_parts()) return call(Fn::floor, {(param("t") - problem.t_begin) / param("dt") + 1.5});
  const Expr place = (time_at_end() - problem.t_begin) / problem.step, nearest = call(Fn::floor, {place + 0.5});
  const Expr is_end = binary(BinaryOp::less, call(Fn::abs, {place - nearest}), param("dt") / (4.0 * problem.step));
  return select(is_end, nearest, nearest + 0.5);
}

/// Condition of an event that does not happen in each step.
std::optional<Expr> condition_by_number(const model::Event& event, const Expr& steps) {
  if (event.every > 0) {
    const double every = event.every;
    return binary(BinaryOp::equal, call(Fn::floor, {steps / every}) * every, steps);
  }
  std::optional<Expr> any;
  for (const int step : event.at) {
    const Expr is_it = binary(BinaryOp::equal, steps, static_cast<double>(step));
    any = any ? binary(BinaryOp::logical_or, *any, is_it) : is_it;
  }
  return any;
}

/// `e` with reads of these fields replaced by the locals.
Expr with_locals(const Expr& e, const std::map<std::string, Expr>& locals) {
  if (const Access* read = as<Access>(e)) {
    const auto found = locals.find(read->field);
    return found == locals.end() ? e : found->second;
  }
  return map_children(e, [&](const Expr& part) { return with_locals(part, locals); });
}

class EventStages {
 public:
  EventStages(Lowering& lowering, std::vector<Stage>& stages, std::map<std::string, std::string>& ends)
      : lowering_(lowering), stages_(stages), ends_(ends) {}

  void add(const model::Event& event, int number, const BeforeEvent& before) {
    if (!before && is_at_the_point(event)) return join(event);
    std::optional<Stage> first = before ? before(static_cast<std::size_t>(number) - 1, reading()) : std::nullopt;
    if (first) stages_.push_back(std::move(*first));
    append(event, number);
  }

 private:
  const Store* last_store(const std::string& field) const {
    const std::vector<Store>& stores = stages_.back().kernel.stores;
    const auto found =
        std::find_if(stores.begin(), stores.end(), [&](const Store& store) { return store.field == field; });
    return found == stores.end() ? nullptr : &*found;
  }

  /// Whether the event fits into the last kernel: that stores all changed states, and the event has no reductions and
  /// reads no neighbours of stored fields.
  bool is_at_the_point(const model::Event& event) const {
    for (const model::Event::Update& update : event.updates) {
      if (!last_store(ends_.at(update.state))) return false;
      Discretiser at_point = lowering_.discretiser(reading());
      Kernel probe = lowering_.kernel("probe");
      probe.stores.push_back({"probe", false, at_point(update.value, lowering_.placement_of(update.state)), {}});
      probe.lets = at_point.lets();
      if (!at_point.preparations().empty()) return false;
      for (const Signature::Read& read : signature(probe).reads) {
        const bool beyond =
            read.interpolated || std::any_of(read.halo.begin(), read.halo.end(), [](int h) { return h > 0; });
        if (beyond && last_store(read.field)) return false;
      }
    }
    return true;
  }

  /// Environment with the states at the end of the step, or after the previous event. Initial guesses of solves are
  /// excluded: they are stored after all events.
  Environment reading() const {
    Environment reading;
    reading.fields = ends_;
    for (const model::State& state : lowering_.problem().states) {
      if (state.is_guess) reading.fields.erase(state.name);
    }
    reading.time = time_at_end();
    return reading;
  }

  /// Merges the event into the last kernel, after the values of its stores.
  void join(const model::Event& event) {
    Kernel& kernel = stages_.back().kernel;
    Discretiser at_point = lowering_.discretiser(reading(), kernel.lets);
    std::map<std::string, Expr> locals;
    for (const model::State& state : lowering_.problem().states) {  // in the model's order, not that of names
      const std::string& field = ends_.at(state.name);
      if (const Store* store = last_store(field))
        locals.emplace(field, at_point.shared(state.name + "_end", store->value));
    }
    const std::optional<Expr> happens = condition_of(event, lowering_.problem(), at_point);
    std::map<std::string, Expr> values;
    for (const model::Event::Update& update : event.updates) {
      const std::string& field = ends_.at(update.state);
      const Expr value = with_locals(at_point(update.value, lowering_.placement_of(update.state)), locals);
      values.emplace(field, happens ? select(*happens, value, locals.at(field)) : value);
    }
    for (Store& store : kernel.stores) {
      if (locals.contains(store.field)) store.value = locals.at(store.field);
      if (values.contains(store.field)) store.value = values.at(store.field);
    }
    for (const Let& let : at_point.lets()) kernel.lets.push_back({let.name, with_locals(let.value, locals)});
  }

  /// Adds the event as a kernel of its own that reads the results of the previous stages.
  void append(const model::Event& event, int number) {
    Kernel kernel = lowering_.kernel(lowering_.problem().scene + "_event" + std::to_string(number));
    Discretiser at_point = lowering_.discretiser(reading());
    const std::optional<Expr> happens = condition_of(event, lowering_.problem(), at_point);
    std::map<std::string, std::string> changed = ends_;
    for (const model::Event::Update& update : event.updates) {
      const std::string into = lowering_.field_beside(update.state, "changed");
      const Expr value = at_point(update.value, lowering_.placement_of(update.state));
      const Expr before = access(ends_.at(update.state));
      kernel.stores.push_back({into, false, happens ? select(*happens, value, before) : value, event.origin});
      changed[update.state] = into;
    }
    stages_.push_back(Lowering::stage(std::move(kernel), at_point, time_at_end()));
    ends_ = changed;
  }

  Lowering& lowering_;
  std::vector<Stage>& stages_;
  std::map<std::string, std::string>& ends_;
};

}  // namespace

void add_events(Lowering& lowering, std::vector<Stage>& stages, std::map<std::string, std::string>& ends,
                const BeforeEvent& before) {
  EventStages events(lowering, stages, ends);
  const std::vector<model::Event>& all = lowering.problem().events;
  for (std::size_t i = 0; i < all.size(); ++i) events.add(all[i], static_cast<int>(i) + 1, before);
}

std::optional<Expr> condition_of(const model::Event& event, const model::Problem& problem, Discretiser& at_point) {
  const bool is_always = event.after_step || (event.every == 1 && !problem.has_parts());
  if (is_always) return std::nullopt;
  return condition_by_number(event, at_point.shared("steps_done", steps_done(problem)));
}

}  // namespace dpde::stencil
