// SPDX-License-Identifier: Apache-2.0
// Networks in files with programs, and the statements that apply them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "source/diagnostic.h"
#include "stencil/stencil.h"
#include "syntax/ast.h"

namespace dpde::stencil {

/// The networks that give their number of channels; the others belong to models.
std::vector<network::Network> read_networks(const ast::File& file, DiagnosticSink& sink);

/// Number of axes that the network's padding names; nullopt without padding.
std::optional<int> told_rank(const ast::File& file, const ast::ApplyItem& apply);

/// nullopt, after a diagnostic, if the network does not exist.
std::optional<NetworkCall> read_network_call(const ast::File& file, const ast::ApplyItem& source, const Module& module,
                                             DiagnosticSink& sink);

/// All fields in the statement.
std::vector<std::string> fields_of(const ast::ApplyItem& apply);

}  // namespace dpde::stencil
