// SPDX-License-Identifier: Apache-2.0
// Calls of networks: corrector(u, nu); with several outputs corrector(a, b).da.
#include <fmt/format.h>

#include <algorithm>

#include "model/analyse/placement.h"
#include "model/build.h"
#include "model/from_ast/formulas/elaborate.h"
#include "model/from_ast/network_from_ast.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

/// The deviation from the mean over the grid; 0 for a uniform expression.
Expr relative_to_mean(const Expr& e) {
  if (is_uniform(e)) return number(0, e->origin);
  return binary(BinaryOp::subtract, e, reduce(Reduce::Kind::mean, e, e->origin), e->origin);
}

}  // namespace

namespace formulas {

namespace {

std::optional<std::vector<Expr>> counted_channels(FormulaScope& here, const network::Network& network,
                                                  const ast::Call& e);

/// One number per channel; vectors by component.
std::optional<std::vector<Expr>> channels(FormulaScope& here, const DeclaredNetwork& declared, const ast::Call& e) {
  const ast::Network& source = *declared.source;
  if (declared.network && counts_channels(source)) return counted_channels(here, *declared.network, e);
  if (!takes(here, e, static_cast<int>(source.inputs.size()))) return std::nullopt;
  std::vector<Expr> channels;
  bool complete = true;
  for (std::size_t i = 0; i < e.arguments.size(); ++i) {
    const std::size_t first = channels.size();
    const ast::Expr& argument = e.arguments[i].value;
    if (source.inputs[i].vector) {
      const auto parts = as_vector(here, numeric(here, argument), argument.range());
      complete = complete && parts;
      if (parts) channels.insert(channels.end(), parts->begin(), parts->end());
    } else {
      const auto value = as_number(here, numeric(here, argument), argument.range());
      complete = complete && value;
      if (value) channels.push_back(*value);
    }
    const bool is_relative = !declared.relative.empty() && declared.relative[i];
    for (std::size_t c = first; is_relative && c < channels.size(); ++c) channels[c] = relative_to_mean(channels[c]);
  }
  return complete ? std::optional(std::move(channels)) : std::nullopt;
}

/// For a network of a program, which has only numbers.
std::optional<std::vector<Expr>> counted_channels(FormulaScope& here, const network::Network& network,
                                                  const ast::Call& e) {
  if (!takes(here, e, network.inputs)) return std::nullopt;
  std::vector<Expr> channels;
  for (const ast::Argument& argument : e.arguments) {
    const auto value = as_number(here, numeric(here, argument.value), argument.value.range());
    if (!value) return std::nullopt;
    channels.push_back(*value);
  }
  return channels;
}

bool may_call_network(FormulaScope& here, const DeclaredNetwork& declared, const ast::Call& e) {
  if (!declared.network && here.elaboration.blocks.program) {
    here.elaboration.sink.report("bad-network", e.callee_range,
                                 {"the network " + e.callee + " is not for a program on these axes"},
                                 "below the model inputs and outputs are numbers: network n(3) -> 2");
    return false;
  }
  const auto falls = std::ranges::find_if(here.elaboration.problem.axes, &Axis::runs_down);
  if (falls != here.elaboration.problem.axes.end()) {
    here.elaboration.sink.report(
        "not-allowed-here", e.callee_range,
        {"the network " + e.callee, fmt::format("a scene with a decreasing axis {}", falls->name)},
        "its weights depend on the order of the cells, which is reversed here");
    return false;
  }
  const bool is_formula = here.context == FormulaContext::initial || here.context == FormulaContext::coefficient;
  if (is_formula && !declared.relative.empty()) {
    here.elaboration.sink.report("not-allowed-here", e.callee_range,
                                 {"the mean that galilean takes", std::string(place_of(here.context))},
                                 "use a network without it: its inputs are known before the run");
    return false;
  }
  if (is_formula || here.is_of_step() || here.context == FormulaContext::quantity) return true;
  const bool is_boundary = here.context == FormulaContext::boundary || here.context == FormulaContext::boundary_weight;
  const std::string hint =
      is_boundary
          ? "write c = " + e.callee +
                "(...) of coordinates and parameters for a coefficient c of the model, and c as the boundary value"
      : here.context == FormulaContext::control || here.context == FormulaContext::control_field
          ? "write the network where the control stands: in the equation or the event"
          : "networks stand in equations, events, initial states, coefficients, observables, losses and tests";
  here.elaboration.sink.report("not-allowed-here", e.callee_range,
                               {"the network " + e.callee, std::string(place_of(here.context))}, hint);
  return false;
}

/// Only vectors may have components at different placements; the call is then computed cell by cell.
bool may_mix_places(FormulaScope& here, const DeclaredNetwork& declared, const NetworkCall& call, SourceRange range) {
  const Placements placements(here.elaboration.problem);
  const Placements::OfCall places = placements.places_of(call, {});
  if (!places.is_cell_by_cell) return true;
  std::size_t first = 0;
  for (const ast::Network::Input& input : declared.source->inputs) {
    const std::size_t count = input.vector ? static_cast<std::size_t>(here.axis_count()) : 1;
    const auto begin = places.arguments.begin() + static_cast<std::ptrdiff_t>(first);
    const auto staggered = std::count_if(begin, begin + static_cast<std::ptrdiff_t>(count),
                                         [](const Placement& place) { return place != Placement{}; });
    const bool is_whole = staggered == 0 || (input.vector && declared.vector && staggered == here.axis_count());
    for (std::size_t i = 0; !is_whole && i < count; ++i) {
      const auto mistake = placements.find_mistake(call.arguments[first + i], {});
      if (!mistake) continue;
      report_misplaced(here.elaboration, *mistake, range);
      return false;
    }
    first += count;
  }
  return true;
}

}  // namespace

TypedExpr inference(FormulaScope& here, const DeclaredNetwork& declared, const ast::Call& e,
                    const ast::Identifier* output, SourceRange range) {
  if (!may_call_network(here, declared, e)) return {};
  const std::string& network = declared.source->name.name;
  const bool is_first_call = here.elaboration.networks.called.insert(network).second;
  for (std::size_t i = 0; is_first_call && i < declared.misfits.size(); ++i) {
    here.elaboration.sink.report("bad-network", declared.misfits[i].range, {declared.misfits[i].text},
                                 declared.misfits[i].hint);
  }
  const auto arguments = channels(here, declared, e);
  for (const ast::Argument& argument : e.arguments) here.elaboration.measures.of(argument.value);  // sums in them fit
  if (!declared.network || !arguments || is_too_large(here, {TypedExpr::Type::vector, *arguments}, range)) return {};
  const auto value = [&](int number, const std::string& name) {
    return network_call({network, *arguments, number, declared.network->outputs, name}, {range});
  };
  const std::string first_name = declared.vector ? axis_name(0) : declared.outputs.empty() ? "" : declared.outputs[0];
  if (!may_mix_places(here, declared, {network, *arguments, 0, declared.network->outputs, first_name}, range))
    return {};
  if (declared.vector) {
    TypedExpr result{here.axis_count() == 1 ? TypedExpr::Type::number : TypedExpr::Type::vector, {}};
    for (int axis = 0; axis < here.axis_count(); ++axis)
      result.parts.push_back(value(axis, here.axis_count() == 1 ? "" : axis_name(axis)));
    return result;
  }
  const std::vector<std::string>& names = declared.outputs;
  if (names.empty()) return {TypedExpr::Type::number, {value(0, "")}};
  const auto found = output ? std::ranges::find(names, output->name) : names.end();
  if (found != names.end())
    return {TypedExpr::Type::number, {value(static_cast<int>(found - names.begin()), names.size() == 1 ? "" : *found)}};
  if (names.size() == 1 && !output) return {TypedExpr::Type::number, {value(0, "")}};
  here.elaboration.sink.report(
      "no-such-output", output ? output->range : e.callee_range, {e.callee, output ? output->name : "without a name"},
      output ? did_you_mean(output->name, names) : "write " + e.callee + "(...)." + names.front());
  return {};
}

}  // namespace formulas

}  // namespace dpde::model
