// SPDX-License-Identifier: Apache-2.0
// Where a name is used, and a text with another name in its place.
#pragma once

#include <string>
#include <vector>

#include "lsp/document.h"

namespace dpde::lsp {

/// Ranges of the name in the document's own text, its declaration included, in order.
std::vector<SourceRange> uses_of(const Document& document, const DeclaredName& name);

/// Why the name at `offset` cannot be replaced by `wanted`; "" if it can. The text with the new name is analysed: it
/// must have as many mistakes as before, so that no other name is hit.
std::string why_not_renamed(const Document& document, int offset, const std::string& wanted);

/// The call around `offset`: the text of its function, and the number of the argument; null if there is none.
Json signature_help(const Document& document, int offset);

}  // namespace dpde::lsp
