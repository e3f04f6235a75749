// SPDX-License-Identifier: Apache-2.0
// Characters to tokens. Every byte is part of a token, a comment, or blank; the last token is end_of_file.
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

/// The tokens point into `source`, which has to live as long as they do.
TokenStream lex(const SourceFile& source, DiagnosticSink& sink);

}  // namespace dpde::ast
