// SPDX-License-Identifier: Apache-2.0
#include "loop/loop.h"

#include <algorithm>
#include <utility>

namespace dpde::loop {

Operation::Operation() = default;
Operation::Operation(const Operation& other) = default;
Operation::Operation(Operation&& other) noexcept = default;
Operation& Operation::operator=(const Operation& other) = default;
Operation& Operation::operator=(Operation&& other) noexcept = default;
Operation::~Operation() = default;

Expr::Expr(double value) : node_(std::make_shared<const Node>(Node{Literal{value}})) {}
Expr::Expr(Node node) : node_(std::make_shared<const Node>(std::move(node))) {}

bool Expr::operator==(const Expr& other) const { return node_ == other.node_ || *node_ == *other.node_; }

const Row* Module::find_row(const std::string& name) const {
  const auto found = std::find_if(rows.begin(), rows.end(), [&](const Row& row) { return row.name == name; });
  return found == rows.end() ? nullptr : &*found;
}

}  // namespace dpde::loop
