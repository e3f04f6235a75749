// SPDX-License-Identifier: Apache-2.0
// Converts characters to tokens. Every byte belongs to a token, a comment, or blanks; the last token is end_of_file.
#pragma once

#include <vector>

#include "source/diagnostic.h"
#include "source/source_file.h"
#include "syntax/parse/token.h"

namespace dpde::ast {

struct TokenStream {
  std::vector<Token> tokens;
  std::vector<Comment> comments;
};

/// The tokens refer to `source`, which must outlive them.
TokenStream lex(const SourceFile& source, DiagnosticSink& sink);

}  // namespace dpde::ast
