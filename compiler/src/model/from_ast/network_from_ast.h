// SPDX-License-Identifier: Apache-2.0
// A network block to network::Network: layers numbered, channels and grids worked out, padding along each axis. The
// same for the network of a model and for the one that stands in a text of a lower level.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "network/network.h"
#include "source/diagnostic.h"
#include "support/vocabulary.h"
#include "syntax/ast.h"

namespace dpde::model {

/// The number that an expression means; nullopt after a diagnostic. `what` is for messages.
using NumberOf = std::function<std::optional<double>(const ast::Expr& e, const std::string& what)>;

/// What a network is made for.
struct NetworkFrame {
  int inputs = 1, outputs = 1;  // channels
  std::vector<Topology> axes;
  Precision real = Precision::f32;  // where the block does not say it
};
std::optional<network::Network> network_from_ast(const ast::Network& source, const NetworkFrame& frame,
                                                 const NumberOf& number_of, DiagnosticSink& sink);

/// Whether the block is of the form network NAME(3) -> 2.
bool counts_channels(const ast::Network& source);
/// A network of a scene has no more than this, its copies under symmetries included.
inline constexpr int most_layers = 1024;
/// Of the form network NAME(3) -> 2 { padding x periodic, y zero; ... } that print(network::Network) gives.
std::optional<network::Network> network_from_ast(const ast::Network& source, DiagnosticSink& sink);

std::optional<network::Init> find_init(std::string_view name);

/// What a network block says beside its layers; each of the two reports what is wrong.
std::vector<network::Padding> paddings_of(const ast::Network& source, const std::vector<Topology>& axes,
                                          DiagnosticSink& sink);
struct NetworkStart {
  network::Init init = network::Init::he;
  std::uint64_t seed = 0;
  std::optional<Precision> real;
};
NetworkStart start_of(const ast::Network& source, const NumberOf& number_of, DiagnosticSink& sink);

/// Those of a layer by name: bias = 0.
using LayerOptions = std::map<std::string, ast::Argument>;
/// Sets axes and order of a reorient by x = -y, y = x, channels = (-2, 1), in a network of `rank` axes; false after a
/// diagnostic.
bool read_orientation(const LayerOptions& options, SourceRange range, int rank, const NumberOf& number_of,
                      network::Layer& layer, DiagnosticSink& sink);

/// The layers, added to `network`, whose channels and padding are known; false after a diagnostic.
bool add_layers(const ast::Network& source, network::Init init, const NumberOf& number_of, network::Network& network,
                DiagnosticSink& sink);

}  // namespace dpde::model
