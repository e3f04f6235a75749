// SPDX-License-Identifier: Apache-2.0
#include "driver/weights.h"

#include <algorithm>

#include "codegen/network_table.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/weights_file.h"
#include "driver/files.h"

namespace dpde::driver {

std::optional<std::vector<double>> load_weights(const model::Problem& problem, const model::Unknown& unknown, const SourceFile& source, DiagnosticSink& sink) {
  const std::string path = find_data_file(unknown.from.file, source.path()).string();
  const std::optional<std::string> bytes = read_file(path, unknown.origin.range, sink);
  if (!bytes) return std::nullopt;
  const codegen::NetworkTable network(*std::ranges::find(problem.networks, unknown.name, &network::Network::name));
  try {
    return weights_of(*network.get(), parse_weights(*bytes, path), path);
  } catch (const Error& error) {
    sink.report("bad-array-file", unknown.origin.range, {unknown.from.file, error.what()});
    return std::nullopt;
  }
}

}  // namespace dpde::driver
