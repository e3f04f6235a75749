// SPDX-License-Identifier: Apache-2.0
// The members of ast.h that need Node to be complete.
#include "syntax/ast.h"

namespace dpde::ast {

Expr::Expr() : node_(std::make_shared<const Node>(Node{Error{}, {}})) {}
Expr::Expr(Node node) : node_(std::make_shared<const Node>(std::move(node))) {}
SourceRange Expr::range() const { return node_->range; }

}  // namespace dpde::ast
