// SPDX-License-Identifier: Apache-2.0
#include "driver/weights.h"

#include <algorithm>

#include "codegen/network_table.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/weights_file.h"
#include "driver/files.h"

namespace dpde::driver {

namespace {

std::optional<std::vector<double>> load(const network::Network& network, const model::Source& from, const SourceFile& source, DiagnosticSink& sink) {
  const std::string path = find_data_file(from.file, source.path()).string();
  const std::optional<std::string> bytes = read_file(path, from.origin.range, sink);
  if (!bytes) return std::nullopt;
  const codegen::NetworkTable table(network);
  try {
    return weights_of(*table.get(), parse_weights(*bytes, path), path);
  } catch (const Error& error) {
    sink.report("bad-array-file", from.origin.range, {from.file, error.what()});
    return std::nullopt;
  }
}

}  // namespace

std::optional<NetworkWeights> load_weights(const model::Problem& problem, const SourceFile& source, DiagnosticSink& sink) {
  std::map<std::string, model::Source> files;
  for (const model::GivenWeights& given : problem.weights) files[given.network] = given.from;
  for (std::size_t i = 0; problem.task && i < problem.task->unknowns.size(); ++i) {
    const model::Unknown& unknown = problem.task->unknowns[i];
    if (unknown.kind == model::Unknown::Kind::network && !unknown.from.file.empty()) files[unknown.name] = unknown.from;
  }
  NetworkWeights weights;
  for (const auto& [name, from] : files) {
    std::optional<std::vector<double>> values = load(*problem.find_network(name), from, source, sink);
    if (!values) return std::nullopt;
    weights[name] = std::move(*values);
  }
  return weights;
}

}  // namespace dpde::driver
