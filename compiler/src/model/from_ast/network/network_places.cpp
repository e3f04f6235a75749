// SPDX-License-Identifier: Apache-2.0
// Restrictions on calls of networks: they cannot mirror values that exist on one wall but not on the other, and they
// have no value on the lower wall.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "model/analyse/placement.h"
#include "model/build.h"
#include "model/from_ast/parts.h"
#include "model/uses.h"

namespace dpde::model {

namespace {

using AlongAxes = std::array<bool, 3>;

/// The axes that a layer reverses or exchanges.
AlongAxes axes_moved(const network::Network& network) {
  AlongAxes moved{};
  for (const network::Layer& layer : network.layers) {
    if (layer.kind != network::LayerKind::reorient) continue;
    for (std::size_t axis = 0; axis < moved.size(); ++axis)
      moved[axis] = moved[axis] || layer.axes[axis] != static_cast<int>(axis) + 1;
  }
  return moved;
}

class NetworkPlaces {
 public:
  explicit NetworkPlaces(Elaboration& elaboration) : elaboration_(elaboration), placements_(elaboration.problem) {}

  void check() {
    if (!placements_.is_staggered()) return;
    for_each_formula(elaboration_.problem, [&](const Use& use) {
      origin_ = use.origin;
      const bool is_anywhere = use.kind == UseKind::test_field;
      walk(use.formula, is_anywhere ? placements_.natural(use.formula).value_or(use.home) : use.home, {});
    });
  }

 private:
  /// `displaced`: axes along which neighbouring values are read, too.
  void walk(const Expr& e, const Placement& wanted, AlongAxes displaced) {
    if (const auto* call = as<NetworkCall>(e)) return look(*call, e->origin, wanted, displaced);
    if (const auto* d = as<Derivative>(e)) {
      const Placement between = toggled(wanted, d->axis);
      const bool is_between =
          d->order == 1 && placements_.only(e) != wanted && placements_.can_be_at(d->operand, between);
      displaced[static_cast<std::size_t>(d->axis)] = true;
      return walk(d->operand, is_between ? between : wanted, displaced);
    }
    if (const auto* here = as<Interpolate>(e)) return walk_between(here->operand, wanted, displaced);
    if (const auto* reduce = as<Reduce>(e)) {
      const Placement there = placements_.operand_placement(*reduce, wanted).value_or(Placement{});
      return walk(reduce->operand, there, reduce->is_over_all() ? AlongAxes{} : displaced);
    }
    if (const auto* advect = as<Advect>(e)) {
      for (const Expr& velocity : advect->velocity) walk_between(velocity, wanted, displaced);
      return walk(advect->operand, wanted, {true, true, true});
    }
    if (const auto* apply = as<Apply>(e)) {
      for (std::size_t i = 0; i < apply->arguments.size(); ++i)
        walk(apply->arguments[i], apply->places[i].value_or(Placement{}), {true, true, true});
      return;
    }
    if (const auto* shift = as<Shift>(e)) {
      for (std::size_t axis = 0; axis < shift->offset.size(); ++axis)
        displaced[axis] = displaced[axis] || shift->offset[axis] != 0;
    }
    for_each_child(e, [&](const Expr& part) { walk(part, wanted, displaced); });
  }

  /// Averages from their own placement to the required one.
  void walk_between(const Expr& e, const Placement& wanted, AlongAxes displaced) {
    const Placement own = placements_.natural(e).value_or(wanted);
    for (std::size_t axis = 0; axis < own.size(); ++axis)
      displaced[axis] = displaced[axis] || own[axis] != wanted[axis];
    walk(e, own, displaced);
  }

  void look(const NetworkCall& call, const Origin& origin, const Placement& wanted, const AlongAxes& displaced) {
    const Placements::OfCall places = placements_.places_of(call, wanted);
    const SourceRange range = origin.range.is_known() ? origin.range : origin_.range;
    check_wall(call, places, displaced, range);
    check_images(call, places, range);
    for (std::size_t i = 0; i < call.arguments.size(); ++i) walk(call.arguments[i], places.arguments[i], {});
  }

  /// Between walls, values on faces are those of the upper faces.
  void check_wall(const NetworkCall& call, const Placements::OfCall& places, const AlongAxes& displaced,
                  SourceRange range) {
    for (std::size_t axis = 0; axis < elaboration_.problem.axes.size(); ++axis) {
      if (!displaced[axis] || !is_on_walls(places.result, axis)) continue;
      elaboration_.sink.report(
          "no-wall-value", range, {"the output of network " + call.network, elaboration_.problem.axes[axis].name},
          "a field has a boundary: give the network's values to one, after step: q = " + call.network +
              "(...), and use q");
      return;
    }
  }

  void check_images(const NetworkCall& call, const Placements::OfCall& places, SourceRange range) {
    const DeclaredNetwork* declared = find_network(elaboration_, call.network);
    if (declared == nullptr || !declared->network) return;
    const AlongAxes moved = axes_moved(*declared->network);
    if (places.is_cell_by_cell && std::ranges::find(moved, true) != moved.end()) {
      elaboration_.sink.report(
          "bad-network", range,
          {"a mirror image or a rotation takes upper faces to lower ones, and network " + call.network +
           " knows the upper ones of each cell"},
          "leave flips and rotations out, or call it at one place: of interpolate(u), to interpolate "
          "what it makes");
      return;
    }
    for (std::size_t axis = 0; axis < elaboration_.problem.axes.size(); ++axis) {
      const bool is_there =
          std::ranges::any_of(places.arguments, [&](const Placement& argument) { return is_on_walls(argument, axis); });
      if (!moved[axis] || (!is_there && !is_on_walls(places.result, axis))) continue;
      const std::string& name = elaboration_.problem.axes[axis].name;
      elaboration_.sink.report(
          "bad-network", range,
          {fmt::format("between walls values on faces across {} have no mirror image: the upper wall is "
                       "among them, the lower one is not",
                       name)},
          fmt::format("leave the symmetry out along {}, or call network {} at the cell centres", name, call.network));
      return;
    }
  }

  bool is_on_walls(const Placement& place, std::size_t axis) const {
    return place[axis] && elaboration_.problem.axes[axis].topology == Topology::bounded;
  }

  Elaboration& elaboration_;
  const Placements placements_;
  Origin origin_;
};

}  // namespace

void check_network_places(Elaboration& elaboration) { NetworkPlaces(elaboration).check(); }

}  // namespace dpde::model
