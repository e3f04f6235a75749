// SPDX-License-Identifier: Apache-2.0
// A scene without a grid has one cell: ordinary differential equations, in which nothing may vary in space.
#include <fmt/format.h>

#include <algorithm>

#include "model/build.h"
#include "model/from_ast/parts.h"
#include "model/print/print_model.h"
#include "model/uses.h"

namespace dpde::model {

namespace {

bool reads_neighbours(const Elaboration& elaboration, const NetworkCall& call) {
  const DeclaredNetwork* declared = find_network(elaboration, call.network);
  return declared != nullptr && declared->network && !declared->network->is_host() &&
         !network::is_pointwise(*declared->network);
}

bool varies(const Elaboration& elaboration, const Expr& e) {
  if (const auto* call = as<NetworkCall>(e)) return reads_neighbours(elaboration, *call);
  if (const auto* apply = as<Apply>(e))
    return std::ranges::any_of(apply->function.body, [&](const Expr& part) {
      return any_part(part, [&](const Expr& inner) { return varies(elaboration, inner); });
    });
  return is<Derivative, Advect, Coordinate, Shift, BandPass, Noise, Sample>(e);
}

/// Whether a formula of this kind needs a grid in order to vary in space.
bool needs_grid_to_vary(UseKind kind) {
  switch (time_of(kind)) {
    case UseTime::step:
    case UseTime::result:
    case UseTime::field:
    case UseTime::never: return true;
    case UseTime::boundary:                // a single cell has no sides
    case UseTime::geometry: return false;  // and no positions
  }
  unreachable("time of a use");
}

/// Reports that the item at `range` needs a grid.
class Gridless {
 public:
  explicit Gridless(Elaboration& elaboration) : elaboration_(elaboration) {}

  void check() {
    for (const auto& [item, range] : items_of<ast::CoordinatesItem>(elaboration_.blocks.scene->items))
      refuse("coordinates", range);
    for (const auto& [item, range] : items_of<ast::FieldItem>(elaboration_.blocks.model->items))
      check_declared(item, range);
    for (const auto& [item, range] : items_of<ast::CoefficientItem>(elaboration_.blocks.model->items))
      check_declared(item, range);
    if (elaboration_.blocks.task) {
      for (const auto& [item, range] : items_of<ast::DataItem>(elaboration_.blocks.task->items)) check_place(item.on);
    }
    if (elaboration_.problem.substeps.rate) refuse("a Courant number", elaboration_.problem.time_origin.range);
    for_each_formula(elaboration_.problem, [&](const Use& use) {
      if (needs_grid_to_vary(use.kind)) check_formula(use.formula);
    });
  }

 private:
  void refuse(const std::string& what, SourceRange range) { report_no_grid(elaboration_, what, range); }

  void check_place(const std::optional<ast::Identifier>& place) {
    if (place && place->name != "centres") refuse("on " + place->name, place->range);
  }

  template <class Item>
  void check_declared(const Item& item, SourceRange range) {
    check_place(item.on);
    if (item.vector) refuse("a vector, which has a component for each axis,", range);
  }

  void check_formula(const Expr& e) {
    SourceRange range;
    std::string what;
    const bool is_any = any_part(e, [&](const Expr& part) {
      if (!varies(elaboration_, part)) return false;
      range = part->origin.range;
      const auto* call = as<NetworkCall>(part);
      const auto* apply = as<Apply>(part);
      what = call    ? fmt::format("network {}, whose layers read other cells,", call->network)
             : apply ? "operator " + apply->function.name
                     : print(part);
      return true;
    });
    if (is_any) refuse(what, range);
  }

  Elaboration& elaboration_;
};

}  // namespace

void report_no_grid(Elaboration& elaboration, const std::string& what, SourceRange range) {
  elaboration.sink.report("missing-grid", range.is_known() ? range : elaboration.blocks.scene->name.range,
                          {elaboration.problem.scene},
                          fmt::format("{} needs one: write grid x = 0 .. 1, cells 128, periodic", what));
}

void check_gridless(Elaboration& elaboration) {
  if (!elaboration.problem.has_grid) Gridless(elaboration).check();
}

}  // namespace dpde::model
