// SPDX-License-Identifier: Apache-2.0
// The meaning of a word of a text.
#pragma once

#include "lsp/document.h"

namespace dpde::lsp {

/// {contents, range}, or null.
Json hover(const Document& document, int offset, const OrderText& order);

/// What is shown in the text: the order of each scene, and the units of observables and names of formulas.
Json inlay_hints(const Document& document, const OrderText& order);

}  // namespace dpde::lsp
