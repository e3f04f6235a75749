// SPDX-License-Identifier: Apache-2.0
#include "stencil/text/networks_from_ast.h"

#include <fmt/format.h>

#include <algorithm>

#include "model/from_ast/network_from_ast.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

const ast::Network* find_network(const ast::File& file, const std::string& name) {
  for (const ast::Declaration& declaration : file.declarations) {
    const auto* network = std::get_if<ast::Network>(&declaration.kind);
    if (network && network->name.name == name) return network;
  }
  return nullptr;
}

std::vector<std::string> fields_or_none(const std::vector<ast::Identifier>& fields) {
  std::vector<std::string> names;
  for (const ast::Identifier& field : fields) names.push_back(field.name == "_" ? "" : field.name);
  return names;
}

NetworkCall::Mode mode_of(ast::ApplyItem::Mode mode) {
  switch (mode) {
    case ast::ApplyItem::Mode::value: return NetworkCall::Mode::value;
    case ast::ApplyItem::Mode::tangent: return NetworkCall::Mode::tangent;
    case ast::ApplyItem::Mode::adjoint: return NetworkCall::Mode::adjoint;
    case ast::ApplyItem::Mode::second: return NetworkCall::Mode::second;
  }
  unreachable("mode of a network");
}

void report_missing(const ast::File& file, const ast::Identifier& name, const Module& module, DiagnosticSink& sink) {
  const ast::Network* written = find_network(file, name.name);
  if (written && written->input_channels) return;  // its errors are already reported
  std::vector<std::string> known;
  for (const network::Network& network : module.networks) known.push_back(network.name);
  const std::string near = nearest_name(name.name, known);
  sink.report("unknown-block", name.range, {"network", name.name},
              written        ? fmt::format("a network for programs counts its channels: network {}(3) -> 2", name.name)
              : near.empty() ? ""
                             : fmt::format("did you mean {}?", near));
}

}  // namespace

std::vector<network::Network> read_networks(const ast::File& file, DiagnosticSink& sink) {
  std::vector<network::Network> networks;
  for (const ast::Declaration& declaration : file.declarations) {
    const auto* source = std::get_if<ast::Network>(&declaration.kind);
    if (!source || !source->input_channels) continue;
    if (find_network(file, source->name.name) != source) {
      sink.report("name-taken", source->name.range, {source->name.name, "another network"});
    } else if (auto network = model::network_from_ast(*source, sink)) {
      networks.push_back(std::move(*network));
    }
  }
  return networks;
}

std::optional<int> told_rank(const ast::File& file, const ast::ApplyItem& apply) {
  const ast::Network* network = find_network(file, apply.network.name);
  if (!network) return std::nullopt;
  for (const ast::Item& item : network->items) {
    const auto* padding = get_if<ast::PaddingItem>(&item.kind);
    if (padding) return std::min(static_cast<int>(padding->axes.size()), max_rank);
  }
  return std::nullopt;
}

std::optional<NetworkCall> read_network_call(const ast::File& file, const ast::ApplyItem& source, const Module& module,
                                             DiagnosticSink& sink) {
  if (!module.find_network(source.network.name)) {
    report_missing(file, source.network, module, sink);
    return std::nullopt;
  }
  return NetworkCall{source.network.name,       mode_of(source.mode),      fields_or_none(source.inputs),
                     fields_or_none(source.by), fields_or_none(source.to), source.weights};
}

std::vector<std::string> fields_of(const ast::ApplyItem& apply) {
  std::vector<std::string> fields;
  for (const auto* list : {&apply.inputs, &apply.by, &apply.to}) {
    const std::vector<std::string> names = fields_or_none(*list);
    fields.insert(fields.end(), names.begin(), names.end());
  }
  std::erase(fields, "");
  return fields;
}

}  // namespace dpde::stencil
