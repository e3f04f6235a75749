// SPDX-License-Identifier: Apache-2.0
// Calls of networks: corrector(u, nu), of several outputs corrector(a, b).da.
#include <algorithm>

#include "model/build.h"
#include "model/from_ast/expressions.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

/// One number a channel: those of vectors, component by component.
std::optional<std::vector<Expr>> Expressions::channels(const ast::Network& source, const ast::Call& e) {
  if (!takes(e, static_cast<int>(source.inputs.size()))) return std::nullopt;
  std::vector<Expr> channels;
  bool complete = true;
  for (std::size_t i = 0; i < e.arguments.size(); ++i) {
    const ast::Expr& argument = e.arguments[i].value;
    if (source.inputs[i].vector) {
      const auto parts = as_vector(numeric(argument), argument.range());
      complete = complete && parts;
      if (parts) channels.insert(channels.end(), parts->begin(), parts->end());
    } else {
      const auto value = as_number(numeric(argument), argument.range());
      complete = complete && value;
      if (value) channels.push_back(*value);
    }
  }
  return complete ? std::optional(std::move(channels)) : std::nullopt;
}

Typed Expressions::inference(const DeclaredNetwork& declared, const ast::Call& e, const ast::Identifier* output, SourceRange range) {
  if (purpose_ != Purpose::equation && purpose_ != Purpose::quantity) return refuse("the network " + e.callee, e.callee_range);
  const std::string& network = declared.source->name.name;
  draft_.called_networks.insert(network);
  const auto arguments = channels(*declared.source, e);
  if (!declared.network || !arguments || is_too_large({Typed::Type::vector, *arguments}, range)) return {};
  const auto value = [&](int number, const std::string& name) {
    return infer({network, *arguments, number, declared.network->outputs, name}, {range});
  };
  if (declared.vector) {
    Typed result{axis_count() == 1 ? Typed::Type::number : Typed::Type::vector, {}};
    for (int axis = 0; axis < axis_count(); ++axis) result.parts.push_back(value(axis, axis_count() == 1 ? "" : axis_name(axis)));
    return result;
  }
  const std::vector<std::string>& names = declared.outputs;
  if (names.empty()) return {Typed::Type::number, {value(0, "")}};
  const auto found = output ? std::ranges::find(names, output->name) : names.end();
  if (found != names.end()) return {Typed::Type::number, {value(static_cast<int>(found - names.begin()), names.size() == 1 ? "" : *found)}};
  if (names.size() == 1 && !output) return {Typed::Type::number, {value(0, "")}};
  draft_.sink.report("no-such-output", output ? output->range : e.callee_range, {e.callee, output ? output->name : "without a name"},
                     output ? did_you_mean(output->name, names) : "write " + e.callee + "(...)." + names.front());
  return {};
}

}  // namespace dpde::model
