// SPDX-License-Identifier: Apache-2.0
// Networks of a text with programs, and the statements that apply them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "source/diagnostic.h"
#include "stencil/stencil.h"
#include "syntax/ast.h"

namespace dpde::stencil {

/// Those that count their channels; others are of models.
std::vector<network::Network> read_networks(const ast::File& file, DiagnosticSink& sink);

/// How many axes the padding of the network names, where there is one.
std::optional<int> told_rank(const ast::File& file, const ast::ApplyItem& apply);

/// nullopt, after a diagnostic, where there is no such network.
std::optional<NetworkCall> read_network_call(const ast::File& file, const ast::ApplyItem& source, const Module& module,
                                             DiagnosticSink& sink);

/// All that stand in it.
std::vector<std::string> fields_of(const ast::ApplyItem& apply);

}  // namespace dpde::stencil
