// SPDX-License-Identifier: Apache-2.0
#include "stencil/passes/work.h"

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "stencil/build.h"
#include "stencil/passes/polynomial.h"

namespace dpde::stencil {

namespace {

bool is_product(const Expr& e) {
  if (const Neg* n = as<Neg>(e)) return is_product(n->operand);
  const Binary* b = as<Binary>(e);
  return b && (b->op == BinaryOp::multiply || b->op == BinaryOp::divide) && !is_uniform(e);
}

/// A product at a point; its uniform factors count as one.
struct Product {
  std::vector<Expr> factors;  // the varying ones
  bool scaled = false;
  int multiplications() const { return static_cast<int>(factors.size()) - (scaled ? 0 : 1); }

  void add(const Expr& e) {
    if (is_uniform(e)) {
      scaled = true;
    } else if (const Neg* n = as<Neg>(e)) {
      add(n->operand);
    } else if (is_product(e)) {
      add(std::get<Binary>(e->kind).left);
      add(std::get<Binary>(e->kind).right);
    } else {
      factors.push_back(e);
    }
  }
};

Product product_of(const Expr& e) {
  Product product;
  product.add(e);
  return product;
}

/// Instructions of an expression at each point; an addition next to a multiplication costs nothing (FMA).
int instructions(const Expr& e) {
  if (is_uniform(e)) return 0;
  int total = 0;
  if (is_product(e)) {
    const Product product = product_of(e);
    for (const Expr& factor : product.factors) total += instructions(factor);
    return total + product.multiplications();
  }
  for_each_child(e, [&](const Expr& child) { total += instructions(child); });
  const Binary* b = as<Binary>(e);
  if (!b) return total + (is<Call, Select>(e) ? 1 : 0);
  const bool adds = b->op == BinaryOp::add || b->op == BinaryOp::subtract;
  const auto multiplies = [](const Expr& x) { return is_product(x) && product_of(x).multiplications() > 0; };
  return total + (adds && (multiplies(b->left) || multiplies(b->right)) ? 0 : 1);
}

}  // namespace

int instructions(const Kernel& kernel) {
  int total = 0;
  for_each_expression(kernel, [&](const Expr& e) { total += instructions(e); });
  return total;
}

int loads(const Kernel& kernel) {
  std::set<std::pair<std::string, Offset>> reads;
  visit(kernel, [&](const Expr& e) {
    if (const Access* a = as<Access>(e)) reads.insert({a->field, a->offset});
  });
  return static_cast<int>(reads.size());
}

int streams(const Kernel& kernel) {
  std::set<std::string> read;
  for (const Signature::Read& r : signature(kernel).reads) read.insert(r.field);
  int written = 0;
  for (const Store& store : kernel.stores) {
    ++written;
    if (store.accumulate) read.insert(store.field);
  }
  return static_cast<int>(read.size()) + written;
}

}  // namespace dpde::stencil
