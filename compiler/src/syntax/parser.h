// SPDX-License-Identifier: Apache-2.0
// Text to ast. Errors go to the sink; what could be understood is returned (an item or declaration with an error in
// it is left out). Any bytes are accepted: no input crashes, hangs or overflows the stack.
#pragma once

#include "source/diagnostic.h"
#include "source/source_file.h"
#include "syntax/ast.h"

namespace dpde::ast {

/// A whole file: declarations with their comments.
File parse(const SourceFile& source, DiagnosticSink& sink);

/// A text that is one expression, such as the value of --set; an Error node after an error.
Expr parse_expression(const SourceFile& source, DiagnosticSink& sink);

}  // namespace dpde::ast

namespace dpde {
using ast::parse;
using ast::parse_expression;
}  // namespace dpde
