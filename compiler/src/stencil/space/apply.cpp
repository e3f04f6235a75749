// SPDX-License-Identifier: Apache-2.0
// Operators with a custom adjoint: each becomes a kernel, to which the adjoint belongs. And networks.
#include <algorithm>
#include <map>
#include <vector>

#include "model/build.h"
#include "stencil/build.h"
#include "stencil/lower/custom_adjoint.h"
#include "stencil/space/discretise.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

Expr same_place(const Expr& e, const Offset& k) {
  return shift(e, k, [](const std::string& name) { return name; });
}

Expr with_lets_replaced(const Expr& e, const std::vector<Let>& lets) {
  const Local* l = as<Local>(e);
  if (!l) return map_children(e, [&](const Expr& child) { return with_lets_replaced(child, lets); });
  for (const Let& let : lets) {
    if (let.name == l->name) return with_lets_replaced(let.value, lets);
  }
  return e;
}

/// A formula for a kernel that stores the operator at the point displaced by `k`: the seed of a point has offset -k.
Expr with_seeds_behind(const Expr& e, const Kernel& kernel, const Offset& k) {
  const Access* a = as<Access>(e);
  if (!a) return map_children(e, [&](const Expr& child) { return with_seeds_behind(child, kernel, k); });
  return seeded_by(kernel, a->field) ? same_place(e, {-k[0], -k[1], -k[2]}) : e;
}

/// The fractional part of a point, as a placement.
model::Placement part_of_cell(const std::array<int, max_rank>& place) {
  model::Placement part{};
  for (std::size_t axis = 0; axis < place.size(); ++axis) part[axis] = place[axis] % 2 != 0;
  return part;
}

Offset whole_cells(const std::array<int, max_rank>& place) {
  Offset cells{};
  for (std::size_t axis = 0; axis < place.size(); ++axis)
    cells[axis] = (place[axis] - (place[axis] % 2 != 0 ? 1 : 0)) / 2;
  return cells;
}

/// The scene parameter passed as argument `name`, if no other argument contains it; else "".
std::string lone_param(const Environment& reading, const std::string& name) {
  const auto value = reading.values.find(name);
  const Param* p = value == reading.values.end() ? nullptr : as<Param>(value->second);
  if (!p) return "";
  for (const auto& [other, held] : reading.values) {
    if (other != name && reads_param(held, p->name)) return "";
  }
  return p->name;
}

/// Number of arguments that are this field.
int count_of(const Environment& reading, const std::string& field) {
  int count = 0;
  for (const auto& [parameter, read] : reading.fields) count += read == field;
  return count;
}

}  // namespace

/// Values of the operator's parameters: fields and uniform expressions.
Environment Discretiser::reading_of(const model::Apply& e, const Place& place) {
  Environment reading;
  reading.time = reading_.time;
  for (std::size_t i = 0; i < e.arguments.size(); ++i) {
    const std::string& parameter = e.function.parameters[i];
    if (model::is_uniform(e.arguments[i])) {
      reading.values.emplace(parameter, at(e.arguments[i], place).value());
    } else {
      Place there{};
      for (std::size_t axis = 0; axis < there.size() && e.places[i]; ++axis) there[axis] = (*e.places[i])[axis] ? 1 : 0;
      reading.fields.emplace(parameter, stored_operand(e.arguments[i], there));
    }
  }
  return reading;
}

/// Adjoint formulas of the fields and parameters that the kernel reads. If one is the argument of several parameters,
/// their formulas are added; if some of these are missing, none is used and the adjoint is derived.
std::vector<CustomAdjoint> Discretiser::custom_adjoints_of(const model::Apply& e, const Environment& reading,
                                                           const model::Placements& inside, const Kernel& kernel,
                                                           const Offset& offset) {
  Environment with_seeds = reading;
  for (std::size_t c = 0; c < kernel.stores.size(); ++c)
    with_seeds.fields[model::seed_of(e.function, c)] = bar_of(kernel.stores[c].field);
  std::vector<CustomAdjoint> given;
  std::map<std::string, int> counts;
  for (const model::Operator::Adjoint& adjoint : e.function.adjoints) {
    const auto field = reading.fields.find(adjoint.parameter);
    const bool is_field = field != reading.fields.end();
    const std::string input =
        is_field == adjoint.of_field ? (is_field ? field->second : lone_param(reading, adjoint.parameter)) : "";
    if (input.empty()) continue;
    const auto parameter = std::find(e.function.parameters.begin(), e.function.parameters.end(), adjoint.parameter);
    const auto& of_input = e.places[static_cast<std::size_t>(parameter - e.function.parameters.begin())];
    const model::Placement place = of_input ? *of_input : inside.natural(adjoint.value).value_or(model::Placement{});
    Discretiser formula(scheme_, names_, rank_, with_seeds, inside);
    const Expr value = with_lets_replaced(formula(adjoint.value, place), formula.lets());
    const Expr moved = with_seeds_behind(value, kernel, offset);
    const auto known =
        std::find_if(given.begin(), given.end(), [&](const CustomAdjoint& g) { return g.input == input; });
    if (known == given.end()) {
      given.push_back({input, moved, adjoint.origin});
    } else {
      known->value = known->value + moved;
    }
    ++counts[input];
  }
  std::erase_if(given, [&](const CustomAdjoint& g) { return count_of(reading, g.input) > counts[g.input]; });
  return given;
}

/// One kernel stores all components; a pass removes those that are not read.
Expr Discretiser::applied_at(const model::Expr& e, const Place& place) {
  const model::Apply& apply = std::get<model::Apply>(e->kind);
  for (const Operand& known : operands_) {
    if (known.place == place && known.value == e) return access(known.field);
  }
  const Offset whole = whole_cells(place);
  if (apply.function.adjoints.empty() && whole != Offset{}) {  // a moving mask: one field, read at an offset
    Place here = place;
    for (std::size_t axis = 0; axis < here.size(); ++axis) here[axis] -= 2 * whole[axis];
    return access(std::get<Access>(applied_at(e, here)->kind).field, whole);
  }
  const Environment reading = reading_of(apply, place);
  const model::Placements inside = placements_.inside(apply, part_of_cell(place));
  Discretiser body(scheme_, names_, rank_, reading, inside);
  body.parts_ = parts_;
  const Offset& offset = whole;
  const std::vector<std::string> suffixes = component_suffixes(apply.function.body.size());
  const std::string stem = names_.fresh_stem(apply.function.name, suffixes);
  Kernel kernel{apply.function.name, rank_, {}, {}, {}, {}};
  for (std::size_t c = 0; c < suffixes.size(); ++c) {
    const bool is_wanted = static_cast<int>(c) == apply.component;
    const model::Placement part = is_wanted ? part_of_cell(place) : apply.results[c];
    kernel.stores.push_back(
        {stem + suffixes[c], false, same_place(body(apply.function.body[c], part), offset), e->origin});
    Place there = place;
    for (std::size_t axis = 0; axis < there.size(); ++axis) there[axis] = 2 * offset[axis] + (part[axis] ? 1 : 0);
    model::Apply component = apply;
    component.component = static_cast<int>(c);
    operands_.push_back({model::apply(std::move(component), e->origin), there, kernel.stores[c].field});
  }
  parts_ = body.parts_;
  for (const Let& let : body.lets_) kernel.lets.push_back({let.name, same_place(let.value, offset)});
  kernel.custom_adjoints = custom_adjoints_of(apply, reading, inside, kernel, offset);
  preparations_.push_back(without_idle_formulas(std::move(kernel)));
  return access(stem + suffixes[static_cast<std::size_t>(apply.component)]);
}

/// One call computes all outputs of the network for the same fields.
Expr Discretiser::inferred_at(const model::NetworkCall& e, const Place& place) {
  const model::Placements::OfCall places = placements_.places_of(e, part_of_cell(place));
  const Offset cells = whole_cells(place);
  require(!placements_.is_staggered() || places.result == part_of_cell(place), "a network's values where they lie");
  NetworkCall network_call{e.network, NetworkCall::Mode::value, {}, {}, {}, false};
  for (std::size_t i = 0; i < e.arguments.size(); ++i) {
    Place there{};
    for (std::size_t axis = 0; axis < there.size(); ++axis) there[axis] = places.arguments[i][axis] ? 1 : 0;
    network_call.inputs.push_back(stored_operand(e.arguments[i], there));
  }
  for (Prerequisite& made : preparations_) {
    NetworkCall* known = std::get_if<NetworkCall>(&made);
    if (!known || known->network != network_call.network || known->inputs != network_call.inputs) continue;
    return access(known->results[static_cast<std::size_t>(e.output)], cells);
  }
  for (int i = 1; i <= e.outputs; ++i)
    network_call.results.push_back(names_.fresh(e.network + "_" + (e.outputs == 1 ? "out" : std::to_string(i))));
  preparations_.push_back(network_call);
  return access(network_call.results[static_cast<std::size_t>(e.output)], cells);
}

}  // namespace dpde::stencil
