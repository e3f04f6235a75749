// SPDX-License-Identifier: Apache-2.0
// Members of ast.h that need the complete type Node.
#include "syntax/ast.h"

namespace dpde::ast {

ItemKind::ItemKind() : Variant(FieldItem{}) {}
ItemKind::ItemKind(const ItemKind& other) = default;
ItemKind::ItemKind(ItemKind&& other) noexcept = default;
ItemKind& ItemKind::operator=(const ItemKind& other) = default;
ItemKind& ItemKind::operator=(ItemKind&& other) noexcept = default;
ItemKind::~ItemKind() = default;

DeclarationKind::DeclarationKind() = default;
DeclarationKind::DeclarationKind(const DeclarationKind& other) = default;
DeclarationKind::DeclarationKind(DeclarationKind&& other) noexcept = default;
DeclarationKind& DeclarationKind::operator=(const DeclarationKind& other) = default;
DeclarationKind& DeclarationKind::operator=(DeclarationKind&& other) noexcept = default;
DeclarationKind::~DeclarationKind() = default;

Expr::Expr() : node_(std::make_shared<const Node>(Node{Error{}, {}})) {}
Expr::Expr(Node node) : node_(std::make_shared<const Node>(std::move(node))) {}
SourceRange Expr::range() const { return node_->range; }

}  // namespace dpde::ast
