// SPDX-License-Identifier: Apache-2.0
// Parses text to an ast. Errors go to the sink; the valid parts are returned, without items and declarations that
// contain an error. Accepts any bytes: no input crashes, hangs or overflows the stack.
#pragma once

#include "source/diagnostic.h"
#include "source/source_file.h"
#include "syntax/ast.h"

namespace dpde::ast {

/// A whole file: declarations with their comments.
File parse(const SourceFile& source, DiagnosticSink& sink);

/// Parses a text that is one expression, such as the value of --set; returns an Error node after an error.
Expr parse_expression(const SourceFile& source, DiagnosticSink& sink);

}  // namespace dpde::ast

namespace dpde {
using ast::parse;
using ast::parse_expression;
}  // namespace dpde
