// SPDX-License-Identifier: Apache-2.0
// The networks of the file, for the axes of the scene; and which of them are called.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <map>

#include "model/from_ast/formulas/built_ins.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/network_from_ast.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

void check_names(Elaboration& elaboration, const std::vector<ast::Identifier>& names, const char* what) {
  std::map<std::string, SourceRange> seen;
  for (const ast::Identifier& name : names) {
    const auto [first, is_new] = seen.emplace(name.name, name.range);
    if (!is_new) report_duplicate(elaboration, fmt::format("{} {}", what, name.name), name.range, first->second);
  }
}

/// scalar, vector, or names.
void bind_outputs(Elaboration& elaboration, DeclaredNetwork& declared) {
  const std::vector<ast::Identifier>& outputs = declared.source->outputs;
  const auto is_type = [](const ast::Identifier& name) { return name.name == "vector" || name.name == "scalar"; };
  const auto type = std::find_if(outputs.begin(), outputs.end(), is_type);
  if (outputs.size() > 1 && type != outputs.end()) {
    elaboration.sink.report("bad-network", type->range,
                            {fmt::format("{} stands alone, or each output has a name", type->name)},
                            "write -> vector, or -> a, b");
    return;
  }
  declared.vector = type != outputs.end() && type->name == "vector";
  if (type != outputs.end()) return;
  check_names(elaboration, outputs, "output");
  for (const ast::Identifier& name : outputs) declared.outputs.push_back(name.name);
}

/// For a scene whose step is a model.
void bind_network(Elaboration& elaboration, DeclaredNetwork& declared) {
  const ast::Network& source = *declared.source;
  if (formulas::find_built_in(source.name.name) != nullptr) {
    elaboration.sink.report("reserved-name", source.name.range, {source.name.name, "network"}, "choose another name");
    return;
  }
  if (const Symbol* meaning = elaboration.names.scope.find(source.name.name)) {
    elaboration.sink.report("name-taken", source.name.range,
                            {source.name.name, "a " + std::string(word_for(meaning->role))},
                            "choose another name for the network");
    return;
  }
  if (source.input_channels || source.output_channels) {
    elaboration.sink.report(
        "bad-network", source.name.range,
        {fmt::format("network {} counts its channels, which only hand-written programs do", source.name.name)},
        fmt::format("give its inputs names: network {}(u: vector, nu) -> vector", source.name.name));
    return;
  }
  std::vector<ast::Identifier> inputs;
  NetworkFrame frame;
  const int axes = static_cast<int>(elaboration.problem.axes.size());
  frame.inputs = 0;
  for (const ast::Network::Input& input : source.inputs) {
    inputs.push_back(input.name);
    frame.inputs += input.vector ? axes : 1;
  }
  check_names(elaboration, inputs, "input");
  bind_outputs(elaboration, declared);
  frame.outputs = declared.vector ? axes : std::max(1, static_cast<int>(declared.outputs.size()));
  for (const Axis& axis : elaboration.problem.axes) frame.axes.push_back(axis.topology);
  frame.real = elaboration.problem.scheme.networks;
  const NumberOf number_of = [&](const ast::Expr& e, const std::string& what) {
    return evaluate(elaboration, e, what);
  };
  declared.network = network_from_ast(source, frame, number_of, elaboration.sink);
  bind_symmetries(elaboration, declared);
}

/// For a hand-written program: as its text says.
void bind_network_of_program(Elaboration& elaboration, DeclaredNetwork& declared) {
  const auto lines = items_of<ast::ApplyItem>(elaboration.blocks.program->items);
  const auto calls_it = [&](const auto& line) { return line.kind.network.name == declared.source->name.name; };
  const bool is_applied = std::any_of(lines.begin(), lines.end(), calls_it);
  if (!is_applied && !counts_channels(*declared.source)) return;
  if (is_applied) elaboration.networks.called.insert(declared.source->name.name);
  declared.network = network_from_ast(*declared.source, elaboration.sink);
  for (int c = 1; declared.network && declared.network->outputs > 1 && c <= declared.network->outputs; ++c)
    declared.outputs.push_back(fmt::format("c{}", c));
  const int axes = static_cast<int>(elaboration.problem.axes.size());
  if (!declared.network || declared.network->rank() == axes) return;
  if (!is_applied) {  // maybe it belongs to another program
    declared.network.reset();
    return;
  }
  elaboration.sink.report(
      "bad-network", declared.source->name.range,
      {fmt::format("network {} is made for {} {}, but the scene has {}", declared.source->name.name,
                   declared.network->rank(), declared.network->rank() == 1 ? "axis" : "axes", axes)});
}

/// corrector = load("corrector.safetensors") in a scene.
void bind_weights(Elaboration& elaboration, const DeclaredNetwork& declared) {
  const std::string& name = declared.source->name.name;
  std::map<std::string, SourceRange> seen;
  for (const auto& [item, range] : items_of<ast::ValueItem>(elaboration.blocks.scene->items)) {
    if (item.name.name != name) continue;
    const auto [first, is_new] = seen.emplace(name, item.name.range);
    if (!is_new) report_duplicate(elaboration, name, item.name.range, first->second);
    const auto* load = std::get_if<ast::Call>(&item.value->kind);
    const auto* file = load && load->callee == "load" && load->arguments.size() == 1
                           ? std::get_if<ast::Text>(&load->arguments[0].value->kind)
                           : nullptr;
    if (!file || !(file->value.ends_with(".safetensors") || file->value.ends_with(".npz"))) {
      elaboration.sink.report("bad-network", item.value.range(),
                              {fmt::format("the weights of network {} come from a file", name)},
                              fmt::format("write {} = load(\"{}.safetensors\"), or .npz", name, name));
      continue;
    }
    if (!is_new) continue;
    GivenWeights& weights = elaboration.problem.weights.emplace_back();
    weights.network = name;
    weights.from.file = file->value;
    weights.from.origin = {item.value.range()};
  }
}

/// Axes that a layer exchanges must have equal cell counts.
void check_exchanges(Elaboration& elaboration, DeclaredNetwork& declared) {
  if (!declared.network || declared.network->rank() != static_cast<int>(elaboration.problem.axes.size())) return;
  for (const network::Layer& layer : declared.network->layers) {
    for (std::size_t axis = 0; axis < elaboration.problem.axes.size(); ++axis) {
      const auto from = static_cast<std::size_t>(std::abs(layer.axes[axis])) - 1;
      const Axis &to = elaboration.problem.axes[axis], &source = elaboration.problem.axes[from];
      if (to.cells == source.cells) continue;
      elaboration.sink.report("bad-network", declared.source->name.range,
                              {fmt::format("network {} exchanges {} and {}, which have {} and {} cells",
                                           declared.source->name.name, to.name, source.name, to.cells, source.cells)},
                              "give both axes as many cells");
      declared.network.reset();
      return;
    }
  }
}

}  // namespace

void bind_networks(Elaboration& elaboration) {
  if (elaboration.problem.axes.empty()) return;  // reported
  for (const ast::Declaration& declaration : elaboration.file.declarations) {
    const auto* source = std::get_if<ast::Network>(&declaration.kind);
    if (!source) continue;
    DeclaredNetwork& declared = elaboration.networks.declared.emplace_back();
    declared.source = source;
    if (elaboration.blocks.program) {
      bind_network_of_program(elaboration, declared);
    } else {
      bind_network(elaboration, declared);
    }
    check_exchanges(elaboration, declared);
    bind_weights(elaboration, declared);
  }
}

const DeclaredNetwork* find_network(const Elaboration& elaboration, const std::string& name) {
  const auto found = std::ranges::find_if(elaboration.networks.declared, [&](const DeclaredNetwork& declared) {
    return declared.source->name.name == name;
  });
  return found == elaboration.networks.declared.end() ? nullptr : &*found;
}

void keep_called_networks(Elaboration& elaboration) {
  std::erase_if(elaboration.problem.weights,
                [&](const GivenWeights& given) { return !elaboration.networks.called.contains(given.network); });
  for (const DeclaredNetwork& declared : elaboration.networks.declared) {
    if (!declared.network) continue;
    if (elaboration.networks.called.contains(declared.source->name.name)) {
      elaboration.problem.networks.push_back(*declared.network);
    } else {
      elaboration.problem.remarks.dropped.push_back(
          fmt::format("network {}: nothing calls it", declared.source->name.name));
    }
  }
}

}  // namespace dpde::model
