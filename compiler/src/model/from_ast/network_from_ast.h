// SPDX-License-Identifier: Apache-2.0
// From a network block to network::Network: numbers the layers, and determines channels, grids and padding along each
// axis. Used for networks of models and for networks in texts of lower levels.
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

/// The value of a constant expression; nullopt after a diagnostic. `what` is for messages.
using NumberOf = std::function<std::optional<double>(const ast::Expr& e, const std::string& what)>;

/// Context for which a network is built.
struct NetworkFrame {
  int inputs = 1, outputs = 1;  // channels
  std::vector<Topology> axes;
  Precision real = Precision::f32;  // if the block does not say it
};
std::optional<network::Network> network_from_ast(const ast::Network& source, const NetworkFrame& frame,
                                                 const NumberOf& number_of, DiagnosticSink& sink);

/// Whether the block has the form network NAME(3) -> 2.
bool counts_channels(const ast::Network& source);
/// Maximum number of layers of a scene's network, including its copies for symmetries.
inline constexpr int most_layers = 1024;
/// Reads the form network NAME(3) -> 2 { padding x periodic, y zero; ... } that print(network::Network) writes.
std::optional<network::Network> network_from_ast(const ast::Network& source, DiagnosticSink& sink);

std::optional<network::Init> find_init(std::string_view name);

/// Items of a network block other than layers; both functions report errors.
std::vector<network::Padding> paddings_of(const ast::Network& source, const std::vector<Topology>& axes,
                                          DiagnosticSink& sink);
struct NetworkStart {
  network::Init init = network::Init::he;
  std::uint64_t seed = 0;
  std::optional<Precision> real;
};
NetworkStart start_of(const ast::Network& source, const NumberOf& number_of, DiagnosticSink& sink);

/// Options of a layer by name: bias = 0.
using LayerOptions = std::map<std::string, ast::Argument>;
/// Reads axes and order of a reorient from x = -y, y = x, channels = (-2, 1), in a network of `rank` axes; false after
/// a diagnostic.
bool read_orientation(const LayerOptions& options, SourceRange range, int rank, const NumberOf& number_of,
                      network::Layer& layer, DiagnosticSink& sink);

/// Adds the layers to `network`, which has its channels and padding; false after a diagnostic.
bool add_layers(const ast::Network& source, network::Init init, const NumberOf& number_of, network::Network& network,
                DiagnosticSink& sink);

}  // namespace dpde::model
