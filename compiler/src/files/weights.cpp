// SPDX-License-Identifier: Apache-2.0
#include "files/weights.h"

#include <algorithm>
#include <set>

#include "codegen/network_table.h"
#include "dpde/runtime/bytes.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/weights_file.h"
#include "files/files.h"

namespace dpde::files {

namespace {

std::optional<std::vector<double>> load(const network::Network& network, const model::Source& from,
                                        const SourceFile& source, DiagnosticSink& sink) {
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

/// By name of the network.
std::map<std::string, model::Source> files_of_weights(const model::Problem& problem) {
  std::map<std::string, model::Source> files;
  for (const model::GivenWeights& given : problem.weights) files[given.network] = given.from;
  for (std::size_t i = 0; problem.task && i < problem.task->unknowns.size(); ++i) {
    const model::Unknown& unknown = problem.task->unknowns[i];
    if (unknown.kind == model::Unknown::Kind::network && !unknown.from.file.empty()) files[unknown.name] = unknown.from;
  }
  return files;
}

}  // namespace

std::optional<NetworkWeights> load_weights(const model::Problem& problem, const SourceFile& source,
                                           DiagnosticSink& sink) {
  NetworkWeights weights;
  for (const auto& [name, from] : files_of_weights(problem)) {
    std::optional<std::vector<double>> values = load(*problem.find_network(name), from, source, sink);
    if (!values) return std::nullopt;
    weights[name] = std::move(*values);
  }
  return weights;
}

std::uint64_t hash_of_files(const model::Problem& problem, const SourceFile& source) {
  std::set<std::string> files;
  const auto add = [&](const model::Source& from) {
    if (!from.file.empty()) files.insert(find_data_file(from.file, source.path()).string());
  };
  for (const model::State& state : problem.states) add(state.initial);
  for (const model::Coefficient& coefficient : problem.coefficients) add(coefficient.value);
  for (std::size_t i = 0; problem.task && i < problem.task->unknowns.size(); ++i) add(problem.task->unknowns[i].from);
  for (const auto& [name, from] : files_of_weights(problem)) add(from);
  std::uint64_t hash = hash_bytes(nullptr, 0);
  for (const std::string& path : files) {
    DiagnosticSink ignored;  // users of the file report that it cannot be read
    const std::string bytes = read_file(path, {}, ignored).value_or("");
    hash = hash_bytes(bytes.data(), bytes.size(), hash);
  }
  return hash;
}

}  // namespace dpde::files
