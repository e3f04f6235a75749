// SPDX-License-Identifier: Apache-2.0
#include "model/analyse/placement.h"

#include <fmt/format.h>

#include <algorithm>

#include "model/build.h"

namespace dpde::model {

namespace {

/// Calls `f` on the children that are evaluated at the same placement as `e`.
template <class F>
void for_each_part_in_place(const Expr& e, const F& f) {
  if (as<Interpolate>(e) || as<Sample>(e) || as<Reduce>(e) || as<NetworkCall>(e) || as<Apply>(e) || as<Solve>(e))
    return;
  if (const Advect* advect = as<Advect>(e)) return f(advect->operand);
  for_each_child(e, f);
}

/// The placement of an operator's result; nullptr for other expressions, and if all its arguments are known everywhere.
const Placement* result_of(const Expr& e) {
  const Apply* apply = as<Apply>(e);
  const bool reads = apply && std::any_of(apply->places.begin(), apply->places.end(),
                                          [](const auto& place) { return place.has_value(); });
  return reads ? &apply->results[static_cast<std::size_t>(apply->component)] : nullptr;
}

}  // namespace

std::string describe(const Placement& placement, int axes) {
  std::string across;
  int count = 0;
  for (int axis = 0; axis < axes; ++axis) {
    if (!placement[static_cast<std::size_t>(axis)]) continue;
    across += fmt::format("{}{}", count == 0 ? "" : " and ", "xyz"[axis]);
    ++count;
  }
  if (count == 0) return "cell centres";
  for (int axis = 0; axis < axes && axes == 3 && count == 2; ++axis) {
    if (!placement[static_cast<std::size_t>(axis)]) return fmt::format("edges along {}", "xyz"[axis]);
  }
  return count == axes && axes > 1 ? "nodes" : fmt::format("faces across {}", across);
}

Placement toggled(Placement placement, int axis) {
  bool& along = placement[static_cast<std::size_t>(axis)];
  along = !along;
  return placement;
}

std::vector<Axis> axes_at(std::vector<Axis> axes, const Placement& placement) {
  for (std::size_t a = 0; a < axes.size(); ++a) {
    const double shift = placement[a] ? axes[a].spacing() / 2 : 0;
    axes[a].low += shift;
    axes[a].high += shift;
  }
  return axes;
}

Placements::Placements(const Problem& problem) : has_waves_(problem.scheme.derivative_order == spectral) {
  const auto add = [&](const std::string& name, const Placement& placement) {
    if (placement != Placement{}) staggered_.emplace(name, placement);
  };
  for (const State& state : problem.states) add(state.name, state.placement);
  for (const Coefficient& coefficient : problem.coefficients) add(coefficient.name, coefficient.placement);
  if (!problem.task) return;
  for (const Datum& datum : problem.task->data) {
    add(datum.name, datum.placement);
    if (datum.series) anywhere_.emplace(datum.name, Anywhere::series);
  }
}

Placement Placements::of(const std::string& field) const {
  const auto found = staggered_.find(field);
  return found == staggered_.end() ? Placement{} : found->second;
}

bool Placements::is_series(const Expr& e) const {
  const Field* field = as<Field>(e);
  return field && anywhere_.contains(field->name);
}

void Placements::collect(const Expr& e, Fields& found, Placement& placement) const {
  if (found == Fields::several || as<Interpolate>(e) || as<Sample>(e)) return;
  if (const Reduce* reduce = as<Reduce>(e)) {
    if (!reduce->is_over_all()) found = Fields::several;  // known everywhere along the reduced axes
    return;
  }
  const Field* field = as<Field>(e);
  if (field && anywhere_.contains(field->name)) return;
  const Placement* result = result_of(e);
  const NetworkCall* network = as<NetworkCall>(e);
  if (network ? !places_of(*network, {}).fits : as<Solve>(e) && misplaced(e, {})) {
    found = Fields::several;  // its operands are not where it is required, whatever the placement
    return;
  }
  if (field || result || network || as<Solve>(e)) {
    const Placement own = field     ? of(field->name)
                          : result  ? *result
                          : network ? places_of(*network, {}).result
                                    : Placement{};
    if (found == Fields::one && own != placement) {
      found = Fields::several;
      return;
    }
    found = Fields::one;
    placement = own;
    return;
  }
  for_each_child(e, [&](const Expr& part) { collect(part, found, placement); });
}

std::optional<Placement> Placements::only(const Expr& e) const {
  Fields found = Fields::none;
  Placement placement{};
  collect(e, found, placement);
  return found == Fields::one ? std::optional(placement) : std::nullopt;
}

/// The operand of an interpolation in `e` is known everywhere.
std::optional<Placements::Mistake> Placements::misplaced(const Expr& e, const Placement& wanted) const {
  if (const Field* field = as<Field>(e)) {
    const Placement own = of(field->name);
    if (own == wanted || anywhere_.contains(field->name)) return std::nullopt;
    return Mistake{e, own, wanted};
  }
  if (const NetworkCall* network_call = as<NetworkCall>(e)) return misplaced_call(e, *network_call, wanted);
  if (const Solve* solve = as<Solve>(e)) {
    if (wanted != Placement{}) return Mistake{e, Placement{}, wanted};
    for (const Expr& start : solve->starts) {
      if (const auto mistake = misplaced(start, {})) return mistake;
    }
    if (const auto mistake = solve->preconditioner ? misplaced(*solve->preconditioner, {}) : std::nullopt)
      return mistake;
    const std::optional<Mistake> mistake = misplaced(solve->operation, {});
    return mistake ? mistake : misplaced(solve->right, {});
  }
  if (const Apply* apply = as<Apply>(e)) {
    const Placement& own = apply->results[static_cast<std::size_t>(apply->component)];
    return wanted == own || !find_mistake_inside(*apply, wanted) ? std::nullopt
                                                                 : std::optional(Mistake{e, own, wanted});
  }
  if (const Reduce* reduce = as<Reduce>(e)) {
    if (operand_placement(*reduce, wanted)) return std::nullopt;
    const auto inside = misplaced(reduce->operand);  // not natural(e), which calls this function
    return inside ? inside : Mistake{e, natural(reduce->operand), wanted};
  }
  if (only(e) == wanted) return std::nullopt;  // as on unstaggered grids
  if (const Interpolate* interpolate = as<Interpolate>(e); interpolate && has_waves_)
    return misplaced(interpolate->operand, wanted);
  if (const Derivative* d = as<Derivative>(e); d && d->order == 1 && !has_waves_) {
    const auto staggered = misplaced(d->operand, toggled(wanted, d->axis));
    return !staggered || !misplaced(d->operand, wanted) ? std::nullopt : staggered;
  }
  std::optional<Mistake> mistake;
  for_each_part_in_place(e, [&](const Expr& part) {
    if (!mistake) mistake = misplaced(part, wanted);
  });
  const Advect* advect = as<Advect>(e);
  for (std::size_t i = 0; advect && !mistake && i < advect->velocity.size(); ++i)
    mistake = misplaced(advect->velocity[i]);
  return mistake;
}

std::optional<Placement> Placements::operand_placement(const Reduce& reduce, const Placement& wanted) const {
  std::vector<Placement> options = candidates(reduce.operand);
  if (options.empty()) options.emplace_back();
  for (Placement placement : options) {
    for (std::size_t axis = 0; axis < placement.size(); ++axis) {
      if (!reduce.over[axis]) placement[axis] = wanted[axis];
    }
    if (can_be_at(reduce.operand, placement)) return placement;
  }
  return std::nullopt;
}

/// Placements that the fields of `e` suggest; the first one, of staggered differences, is preferred.
void Placements::add_candidates(const Expr& e, std::vector<Placement>& found) const {
  if (const Field* field = as<Field>(e)) {
    if (!anywhere_.contains(field->name)) found.push_back(of(field->name));
    return;
  }
  if (const NetworkCall* network = as<NetworkCall>(e)) return found.push_back(places_of(*network, {}).result);
  if (as<Solve>(e)) return found.push_back({});
  if (const Placement* result = result_of(e)) {
    const Apply& apply = *as<Apply>(e);
    found.push_back(*result);
    return inside(apply, *result).add_candidates(apply.function.body[static_cast<std::size_t>(apply.component)], found);
  }
  const std::size_t before = found.size();
  if (const Reduce* reduce = as<Reduce>(e); reduce && !reduce->is_over_all()) {
    add_candidates(reduce->operand, found);
    for (std::size_t i = before; i < found.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) found[i][axis] = found[i][axis] && !reduce->over[axis];
    }
    return;
  }
  for_each_part_in_place(e, [&](const Expr& part) { add_candidates(part, found); });
  const Derivative* d = as<Derivative>(e);
  if (!d || d->order != 1 || has_waves_) return;
  const std::vector<Placement> same(found.begin() + static_cast<std::ptrdiff_t>(before), found.end());
  for (std::size_t i = before; i < found.size(); ++i) found[i] = toggled(found[i], d->axis);
  found.insert(found.end(), same.begin(), same.end());
}

std::vector<Placement> Placements::candidates(const Expr& e) const {
  std::vector<Placement> found, unique;
  add_candidates(e, found);
  for (const Placement& placement : found) {
    if (std::find(unique.begin(), unique.end(), placement) == unique.end()) unique.push_back(placement);
  }
  return unique;
}

std::optional<Placement> Placements::natural(const Expr& e) const {
  for (const Placement& placement : candidates(e)) {
    if (can_be_at(e, placement)) return placement;
  }
  return std::nullopt;
}

/// For bodies of operators only, where arguments appear as fields.
bool Placements::holds_number_argument(const Expr& e) const {
  return any_part(e, [&](const Expr& part) {
    const Field* field = as<Field>(part);
    const auto found = field ? anywhere_.find(field->name) : anywhere_.end();
    return found != anywhere_.end() && found->second == Anywhere::argument;
  });
}

Placements Placements::inside(const Apply& apply, const Placement& wanted) const {
  Placements inner;
  inner.has_waves_ = has_waves_;
  if (!is_staggered()) return inner;
  const Operator& function = apply.function;
  for (std::size_t i = 0; i < function.parameters.size(); ++i) {
    if (apply.places[i]) inner.staggered_.emplace(function.parameters[i], *apply.places[i]);
    if (!apply.places[i]) inner.anywhere_.emplace(function.parameters[i], Anywhere::argument);
  }
  for (std::size_t c = 0; c < function.body.size(); ++c) {
    inner.staggered_.emplace(seed_of(function, c), static_cast<int>(c) == apply.component ? wanted : apply.results[c]);
  }
  return inner;
}

std::optional<Placements::Mistake> Placements::find_mistake_inside(const Apply& apply, const Placement& wanted) const {
  const Placements inner = inside(apply, wanted);
  const Operator& function = apply.function;
  for (std::size_t c = 0; c < function.body.size(); ++c) {
    const Placement& place = static_cast<int>(c) == apply.component ? wanted : apply.results[c];
    if (const auto mistake = inner.find_mistake(function.body[c], place)) return mistake;
  }
  for (const Operator::Adjoint& adjoint : function.adjoints) {
    const auto parameter = std::find(function.parameters.begin(), function.parameters.end(), adjoint.parameter);
    const std::optional<Placement>& place =
        apply.places[static_cast<std::size_t>(parameter - function.parameters.begin())];
    if (adjoint.of_field != place.has_value()) continue;
    const auto mistake =
        adjoint.of_field ? inner.find_mistake(adjoint.value, *place) : inner.find_mistake(adjoint.value);
    if (mistake) return mistake;
  }
  return std::nullopt;
}

std::optional<Placements::Mistake> Placements::misplaced(const Expr& e) const {
  std::optional<Mistake> first;
  for (const Placement& placement : candidates(e)) {
    const auto mistake = misplaced(e, placement);
    if (!mistake) return std::nullopt;
    if (!first) first = mistake;
  }
  return first;
}

std::optional<Placements::Mistake> Placements::bad_interpolation(const Expr& e) const {
  std::optional<Mistake> mistake;
  for_each_child(e, [&](const Expr& part) {
    if (!mistake) mistake = bad_interpolation(part);
  });
  const Reduce* reduce = as<Reduce>(e);
  if (!mistake && reduce) return misplaced(reduce->operand);
  const Interpolate* interpolated = as<Interpolate>(e);
  if (mistake || !interpolated || natural(interpolated->operand) || holds_number_argument(interpolated->operand))
    return mistake;
  mistake = misplaced(interpolated->operand);
  return mistake ? mistake : Mistake{e, std::nullopt, {}};
}

std::optional<Placements::Mistake> Placements::find_mistake(const Expr& e, const Placement& wanted) const {
  const auto inside = bad_interpolation(e);
  return inside ? inside : misplaced(e, wanted);
}

std::optional<Placements::Mistake> Placements::find_mistake(const Expr& e) const {
  const auto inside = bad_interpolation(e);
  return inside ? inside : misplaced(e);
}

}  // namespace dpde::model
