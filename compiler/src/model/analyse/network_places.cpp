// SPDX-License-Identifier: Apache-2.0
// Placements of the arguments and outputs of networks.
#include <algorithm>

#include "model/analyse/placement.h"
#include "model/build.h"

namespace dpde::model {

namespace {

/// Whether it contains only numbers and coordinates, which are known everywhere. An interpolation does not count: a
/// network of it lies at the centres, and its output is interpolated in the text.
bool is_of_places(const Placements& placements, const Expr& e) {
  const bool has_place = is<Interpolate, Solve, Apply, Field>(e);
  if (has_place) return placements.is_series(e);
  const auto* reduce = as<Reduce>(e);
  if (reduce && reduce->is_over_all()) return true;
  return !any_child(e, [&](const Expr& part) { return !is_of_places(placements, part); });
}

/// Placements of the components of a vector on faces, or on edges.
std::vector<Placement> places_of_vector(bool on_faces, std::size_t axes) {
  std::vector<Placement> places(axes, Placement{});
  for (std::size_t component = 0; component < axes; ++component) {
    for (std::size_t axis = 0; axis < axes; ++axis) places[component][axis] = (axis == component) == on_faces;
  }
  return places;
}

}  // namespace

Placements::OfCall Placements::places_of(const NetworkCall& call, const Placement& wanted) const {
  if (!is_staggered()) return laid_out(call, wanted);
  const std::pair key(&call, wanted);
  if (const auto known = known_.calls.find(key); known != known_.calls.end()) return known->second;
  ++known_.depth;
  OfCall found = laid_out(call, wanted);
  for (std::size_t i = 0; i < call.arguments.size(); ++i)
    found.fits = found.fits && can_be_at(call.arguments[i], found.arguments[i]);
  known_.calls.emplace(key, found);
  if (--known_.depth == 0) known_.calls.clear();
  return found;
}

Placements::OfCall Placements::laid_out(const NetworkCall& call, const Placement& wanted) const {
  const std::vector<Expr>& arguments = call.arguments;
  const auto all_at = [&](const Placement& place) { return OfCall{std::vector(arguments.size(), place), place}; };
  if (!is_staggered()) return all_at({});
  if (std::ranges::all_of(arguments, [&](const Expr& argument) { return is_of_places(*this, argument); }))
    return all_at(wanted);
  std::vector<Placement> options{Placement{}};
  for (const Expr& argument : arguments) std::ranges::copy(candidates(argument), std::back_inserter(options));
  for (const Placement& place : options) {
    if (std::ranges::all_of(arguments, [&](const Expr& argument) { return can_be_at(argument, place); }))
      return all_at(place);
  }
  if (const auto mixed = cell_by_cell(call)) return *mixed;
  return all_at(std::ranges::find(options, wanted) == options.end() ? Placement{} : wanted);
}

/// Components of vectors at their own placements, all other arguments at the centres; nullopt if one of those lies
/// elsewhere.
std::optional<Placements::OfCall> Placements::cell_by_cell(const NetworkCall& call) const {
  const auto axes = static_cast<std::size_t>(call.outputs);
  const bool is_component = axes > 1 && axes <= 3 && call.name == std::string(1, "xyz"[call.output]);
  for (const bool on_faces : {true, false}) {
    if (!is_component) break;
    const std::vector<Placement> of_vector = places_of_vector(on_faces, axes);
    OfCall found{{}, of_vector[static_cast<std::size_t>(call.output)], false};
    const auto is_vector_at = [&](std::size_t first) {
      bool is_it = first + axes <= call.arguments.size();
      for (std::size_t i = 0; is_it && i < axes; ++i) is_it = natural(call.arguments[first + i]) == of_vector[i];
      return is_it;
    };
    while (found.arguments.size() < call.arguments.size()) {
      const bool is_vector = is_vector_at(found.arguments.size());
      found.is_cell_by_cell = found.is_cell_by_cell || is_vector;
      if (is_vector) std::ranges::copy(of_vector, std::back_inserter(found.arguments));
      if (!is_vector) found.arguments.emplace_back();
    }
    if (found.is_cell_by_cell) return found;
  }
  return std::nullopt;
}

std::optional<Placements::Mistake> Placements::misplaced_call(const Expr& e, const NetworkCall& call,
                                                              const Placement& wanted) const {
  const OfCall places = places_of(call, wanted);
  for (std::size_t i = 0; !places.fits && i < call.arguments.size(); ++i) {
    if (const auto mistake = misplaced(call.arguments[i], places.arguments[i])) return mistake;
  }
  return places.result == wanted ? std::nullopt : std::optional(Mistake{e, places.result, wanted});
}

}  // namespace dpde::model
