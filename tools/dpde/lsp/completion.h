// SPDX-License-Identifier: Apache-2.0
// Completion proposals at a position of a text.
#pragma once

#include "lsp/document.h"

namespace dpde::lsp {

/// An array of {label, kind, detail, documentation}.
Json completions(const Document& document, int offset);

}  // namespace dpde::lsp
